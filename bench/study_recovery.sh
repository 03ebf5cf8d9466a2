#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Least squares on every case with a known answer: fitted moduli with their intervals beside the generator's, errors in
# sample and held out, runs and seconds (docs/study.md, recovery).
#
#   bench/study_recovery.sh DATA/hidden-open WORK [BIN] [TRIANGLES]
source "$(dirname "$0")/study_common.sh"
printf '%-20s %7s %7s %18s %7s %7s %18s %6s %6s %6s %6s %5s %7s\n' case breast truth interval skin truth interval \
  MAEst RMS blocks tilt runs seconds
for answer in "$data"/answers/*.json; do
  case=$(basename "$answer" .json)
  mesh_of "$case"
  [ -f "$work/$case/fit/calibration.json" ] || tool calibrate "$data/$case" "$work/$case/mesh.vtu" -o "$work/$case/fit"
  jq -r --slurpfile truth "$answer" --arg case "$case" '
    def r3: . * 1000 | round / 1000; def r2: . * 100 | round / 100;
    [$case, (.parameters[0].value | r3), ($truth[0].parameters.Eb | r3),
     "\(.parameters[0].interval95[0] | r3) to \(.parameters[0].interval95[1] | r3)",
     (.parameters[1].value | r2), ($truth[0].parameters.Es | r2),
     "\(.parameters[1].interval95[0] | r2) to \(.parameters[1].interval95[1] | r2)",
     (.mae_study_mm | r2), (.rms_mm | r2), (.held_out_rms_mm | r2), (.held_out.by_pose[0].rms_mm // null | if . then r2 else "-" end),
     .evaluations, (.timing.stages_s.fit | r2)] | @tsv' "$work/$case/fit/calibration.json" |
    while IFS=$'\t' read -r -a f; do
      printf '%-20s %7s %7s %18s %7s %7s %18s %6s %6s %6s %6s %5s %7s\n' "${f[@]}"
    done
done
