# SPDX-License-Identifier: AGPL-3.0-or-later
# Read by the scripts on what the mesh does to the answer: bench/mesh_NAME.sh DATA/hidden-open CASE WORK [BIN]
# Leaves labels, surfaces and the model at the generator's own moduli in WORK.
set -euo pipefail
data=${1:?folder with the cases and answers/}
name=${2:?case, for example null-1}
work=${3:?folder for the results}
bin=${4:-build/bin}
case=$data/$name
export OMP_NUM_THREADS=1

# tool NAME ARGUMENTS…: exit code 1 (written, a target was not met) does not stop the run.
tool() { "$bin/supine-$1" "${@:2}" --force --quiet 2>>"$work/messages.txt" || [ $? -eq 1 ]; }

mkdir -p "$work"
if [ ! -e "$work/truth.toml" ]; then
  tool segment "$case" -o "$work/labels.vti"
  tool reconstruct "$work/labels.vti" -o "$work"
  breast=$(jq -r .parameters.Eb "$data/answers/$name.json") skin=$(jq -r .parameters.Es "$data/answers/$name.json")
  sed "/^\[breast\]/,/^\[skin\]/s/value = [0-9.]*/value = $breast/; /^\[skin\]/,/^\[interface\]/s/value = [0-9.]*/value = $skin/" \
    "$case/model.toml" >"$work/truth.toml"
fi
