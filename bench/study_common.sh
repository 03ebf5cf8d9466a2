# SPDX-License-Identifier: AGPL-3.0-or-later
# Read by the study's scripts: bench/study_NAME.sh DATA/hidden-open WORK [BIN]
# Tools run on one thread, so that their seconds can be compared; tables are printed as Markdown.
set -euo pipefail
data=${1:?folder with the cases and answers/}
work=${2:?folder for the results}
bin=${3:-build/bin}
here=$(dirname "${BASH_SOURCE[0]}")
study_triangles=1000   # gives about the 3,025 tetrahedra of the study
default_triangles=2500 # of make CASE=…
cores=$(nproc)
export OMP_NUM_THREADS=1
mkdir -p "$work"

# tool NAME ARGUMENTS…: exit code 1 (written, a target was not met) does not stop the study.
tool() { "$bin/supine-$1" "${@:2}" --force --quiet 2>>"$work/messages.txt" || [ $? -eq 1 ]; }

# mesh_of CASE TRIANGLES: makes WORK/CASE/TRIANGLES.vtu once and says its path.
mesh_of() {
  local out=$work/$1 mesh=$work/$1/$2.vtu
  if [ ! -f "$mesh" ]; then
    mkdir -p "$out"
    [ -f "$out/breast.vtp" ] || {
      tool segment "$data/$1" -o "$out/labels.vti"
      tool reconstruct "$out/labels.vti" -o "$out"
    }
    tool decimate "$out/breast.vtp" --triangles "$2" -o "$out/coarse$2.vtp"
    tool tetrahedralise "$out/coarse$2.vtp" "$out/muscle.vtp" "$out/labels.vti" -o "$mesh"
  fi
  echo "$mesh"
}

# size_of MESH: for the head of a table.
size_of() { jq -r '"\(.cells) tetrahedra, \(.triangles) surface triangles"' "${1%.vtu}.json"; }

# with_moduli FROM TO BREAST BREAST_SD SKIN SKIN_SD: a model with other starts.
with_moduli() {
  sed "/^\[breast\]/,/^\[skin\]/s/^young_modulus_kpa.*/young_modulus_kpa = { value = $3, prior_sd = $4, lower = 0.05, upper = 20 }/
/^\[skin\]/,/^\[interface\]/s/^young_modulus_kpa.*/young_modulus_kpa = { value = $5, prior_sd = $6, lower = 0.5, upper = 300 }/" "$1" >"$2"
}
