#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Null cases with something wrong in measurement or numbers: the diagnosis should blame that and no tissue effect.
# Prints a table (docs/diagnosis.md).
#
#   bench/artefact_trials.sh WORK BIN CASE…        null cases: labels.nrrd with labels 0 to 5, ASCII supine.ply
set -euo pipefail
work=${1:?folder for the results}
bin=${2:?folder of the tools}
shift 2
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$work"
printf '%-18s %-16s %-16s %-34s %7s %9s %s\n' case trial verdict named p held-out 'best of the catalogue'
for case in "$@"; do
  name=$(basename "$case")
  for trial in none coarse stiff_poisson shift outliers dilated; do
    copy=$work/$name-$trial
    triangles=2500
    kind=$trial
    if [ $trial = coarse ]; then kind=none triangles=800; fi
    if [ ! -f "$copy/out/diagnosis.json" ]; then
      rm -rf "$copy"
      "$here/artefact_case.py" "$case" "$copy" $kind
      make --no-print-directory -f "$here/../pipeline/Makefile" BIN="$bin" CASE="$copy" TRIANGLES=$triangles MAX_DISTANCE_MM=2 \
        THREADS="${THREADS:-0}" calibrate diagnose >"$copy/log" 2>&1 || { echo "$name $trial failed: $(tail -1 "$copy/log")"; continue; }
    fi
    jq -r --arg name "$name" --arg trial "$trial" '[$name, $trial, .verdict, (.missing | join(" or ") | if . == "" then "-" else . end),
        ([.candidates[].p_value] | min), (.base_held_out_rms_mm * 100 | round / 100), .candidates[0].effect] | @tsv' \
      "$copy/out/diagnosis.json" | while IFS=$'\t' read -r n t v m p h b; do
      printf '%-18s %-16s %-16s %-34s %7s %9s %s\n' "$n" "$t" "$v" "$m" "$p" "$h" "$b"
    done
  done
done
