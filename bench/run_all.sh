#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Every measurement of docs/verification.md and docs/performance.md, one after the other, each into its own file. Takes
# several hours on two cores and wants a quiet machine. What is not there (data, ccx, gmsh) is skipped and said.
#
#   bench/run_all.sh [DATA] [WORK] [BIN]
set -uo pipefail
cd "$(dirname "$0")/.."
data=${1:-data} # docs/data.md
work=${2:-build/bench}
bin=${3:-build/bin}
mkdir -p "$work"
export OPENBLAS_CORETYPE=${OPENBLAS_CORETYPE:-SkylakeX}
python=python3
/usr/bin/python3 -c 'import matplotlib' 2>/dev/null && python=/usr/bin/python3 # Debian's has the plot library

# part NAME MINUTES COMMAND…
part() {
  echo "== $1 (about $2 minutes)"
  local start=$SECONDS
  "${@:3}" >"$work/$1.md" 2>"$work/$1.log" && echo "   done in $((SECONDS - start)) s: $work/$1.md" ||
    echo "   stopped with code $? after $((SECONDS - start)) s: $work/$1.log"
}

have() { [ -e "$1" ] || { echo "== $1 is not there: skipped"; false; }; }

have "$data/meshes" && {
  part calculix 5 $python bench/calculix.py "$data/meshes" "$work/calculix" --bin "$bin"
  part cost_vs_size 30 $python bench/cost_vs_size.py "$data/meshes/breast.geo" "$work/cost" --bin "$bin" \
    --plot docs/images/cost_vs_size.png
}
have "$data/hidden-open" && part round_trips 30 bench/round_trips.sh "$data" "$work/round_trips" "$bin"
part inverse_examples 10 "$bin/test_verification" --gtest_also_run_disabled_tests '--gtest_filter=*Table'
part robustness 120 "$bin/bench_robustness" "$work/robustness"
part robustness_table 1 $python bench/robustness_table.py "$work/robustness"
