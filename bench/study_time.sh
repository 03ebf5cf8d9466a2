#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# From the grey MRI and the surface scan to the calibrated prediction (F7): every stage of make CASE=… calibrate on the
# shipped sample, on all cores.
#
#   bench/study_time.sh DATA/hidden-open WORK [BIN]
source "$(dirname "$0")/study_common.sh"
unset OMP_NUM_THREADS
out=$work/time
rm -rf "$out"
start=$(date +%s.%N)
make --no-print-directory -f "$here/../pipeline/Makefile" CASE="$here/../samples/ligament" OUT="$out" \
  BIN="$(realpath "$bin")" METHOD=least-squares compare calibrate >"$work/time.log" 2>&1
end=$(date +%s.%N)
echo "| stage | s |"
echo "|---|---|"
for stage in labels breast coarse mesh supine comparison calibration calibrated/supine calibrated/comparison; do
  jq -r --arg stage "$stage" '"| \($stage) | \(.timing.total_s * 10 | round / 10) |"' "$out/$stage.json"
done
awk -v s="$start" -v e="$end" 'BEGIN { printf "| all, with make | %.1f |\n", e - s }'
