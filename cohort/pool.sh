#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# One table and one page of all cases, where any has a result to show: pool.sh BIN COHORT [OUT]
set -euo pipefail
bin=$1 cohort=$2 out=${3:-}
shopt -s nullglob
if [ -n "$out" ]; then
  found=("$out"/*/comparison.json "$out"/*/calibration.json "$out"/*/diagnosis.json)
else
  found=("$cohort"/*/out/comparison.json "$cohort"/*/out/calibration.json "$cohort"/*/out/diagnosis.json)
fi
((${#found[@]})) || exit 0
if [ -n "$out" ]; then
  "$bin/supine-cohort" "$cohort" --results "$out" -o "$out" --force --quiet && echo "All of them: $out/cohort.html"
else
  "$bin/supine-cohort" "$cohort" --force --quiet && echo "All of them: $cohort/cohort.html"
fi
