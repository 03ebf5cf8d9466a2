# SPDX-License-Identifier: AGPL-3.0-or-later
# Read by the study's scripts: bench/study_NAME.sh DATA/hidden-open WORK [BIN] [TRIANGLES]
set -euo pipefail
data=${1:?folder with the cases and answers/}
work=${2:?folder for the results}
bin=${3:-build/bin}
triangles=${4:-2500}
mkdir -p "$work"

# tool NAME ARGUMENTS…: exit code 1 (written, a target was not met) does not stop the study.
tool() { "$bin/supine-$1" "${@:2}" --force --quiet 2>>"$work/messages.txt" || [ $? -eq 1 ]; }

# mesh_of CASE: WORK/CASE/mesh.vtu, made once.
mesh_of() {
  local out=$work/$1
  [ -f "$out/mesh.vtu" ] && return
  mkdir -p "$out"
  tool segment "$data/$1" -o "$out/labels.vti"
  tool reconstruct "$out/labels.vti" -o "$out"
  tool decimate "$out/breast.vtp" --triangles "$triangles" -o "$out/coarse.vtp"
  tool tetrahedralise "$out/coarse.vtp" "$out/muscle.vtp" "$out/labels.vti" -o "$out/mesh.vtu"
}

# with_moduli FROM TO BREAST BREAST_SD SKIN SKIN_SD: a model with other starts.
with_moduli() {
  sed "/^\[breast\]/,/^\[skin\]/s/^young_modulus_kpa.*/young_modulus_kpa = { value = $3, prior_sd = $4, lower = 0.05, upper = 20 }/
/^\[skin\]/,/^\[interface\]/s/^young_modulus_kpa.*/young_modulus_kpa = { value = $5, prior_sd = $6, lower = 0.5, upper = 300 }/" "$1" >"$2"
}
