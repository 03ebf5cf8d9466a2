#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Every table of docs/study.md, one after the other: an hour or more on two cores; run it on a quiet machine.
#
#   bench/study.sh DATA/hidden-open WORK [BIN] [TRIANGLES]
set -euo pipefail
here=$(dirname "$0")
for part in recovery loop ligament sensitivity table1; do
  echo "== $part"
  "$here/study_$part.sh" "$@"
done
case_mesh=$2/null-1/mesh.vtu
"${3:-build/bin}/supine-calibrate" "$1/null-1" "$case_mesh" --map 15 --force --quiet -o "$2/ridge"
"$here/study_ridge.py" "$2/ridge/error_map.csv" "$2/ridge.png" "$2"/table1/null-*/*/calibration.json
"${3:-build/bin}/bench_interval_coverage" "$1/null-1" "$case_mesh" 200
