#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Least squares on every case with a known answer: fitted moduli with their intervals beside the generator's, errors in
# sample and held out, runs and seconds. Cases other than the nulls have an effect that the model lacks.
#
#   bench/study_recovery.sh DATA/hidden-open WORK [BIN]
source "$(dirname "$0")/study_common.sh"
echo "| case | E_breast, kPa | interval | truth | E_skin, kPa | interval | truth | MAE | RMS | blocks | tilt45 | runs | s |"
echo "|---|---|---|---|---|---|---|---|---|---|---|---|---|"
for answer in "$data"/answers/*.json; do
  case=$(basename "$answer" .json)
  fit=$work/$case/fit
  mesh=$(mesh_of "$case" $default_triangles)
  [ -f "$fit/calibration.json" ] || tool calibrate "$data/$case" "$mesh" --method least-squares --threads 1 -o "$fit"
  jq -r --slurpfile truth "$answer" --arg case "$case" '
    def r3: . * 1000 | round / 1000; def r2: . * 100 | round / 100; def r1: . * 10 | round / 10;
    "| " + ([$case, (.parameters[0].value | r3), "\(.parameters[0].interval95[0] | r3) to \(.parameters[0].interval95[1] | r3)",
     ($truth[0].parameters.Eb | r3),
     (.parameters[1].value | r1), "\(.parameters[1].interval95[0] | r1) to \(.parameters[1].interval95[1] | r1)",
     ($truth[0].parameters.Es | r1),
     (.mae_study_mm | r2), (.rms_mm | r2), (.held_out_rms_mm | r2),
     (.held_out.by_pose[0].rms_mm // null | if . then r2 else "-" end),
     .evaluations, (.timing.stages_s.fit | r1)] | map(tostring) | join(" | ")) + " |"' "$fit/calibration.json"
done
