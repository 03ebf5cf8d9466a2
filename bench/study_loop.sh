#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The loop by hand: calibrate, diagnose, add the effect that is named first, calibrate again; does the error fall?
#
#   bench/study_loop.sh DATA/hidden-open WORK [BIN] [CASE…]
source "$(dirname "$0")/study_common.sh"
cases=("${@:4}")
[ ${#cases[@]} -gt 0 ] || cases=(ligament-1)
echo "| truth | verdict | named | added | RMS, mm | then | blocks | then | tilt45 | then | noise, mm |"
echo "|---|---|---|---|---|---|---|---|---|---|---|"
figures() { jq -r '[.rms_mm, .held_out_rms_mm, .held_out.by_pose[0].rms_mm] | map(if . then . * 100 | round / 100 else "-" end) | @tsv' "$1/calibration.json"; }
for case in "${cases[@]}"; do
  mesh=$(mesh_of "$case" $default_triangles)
  fit=$work/$case/fit
  [ -f "$fit/calibration.json" ] || tool calibrate "$data/$case" "$mesh" --method least-squares --threads 1 -o "$fit"
  tool diagnose "$data/$case" "$mesh" --model "$fit/model.toml" -o "$fit"
  verdict=$(jq -r .verdict "$fit/diagnosis.json")
  named=$(jq -r '.missing | join(", ")' "$fit/diagnosis.json")
  noise=$(jq -r '.poses[0].noise_mm' "$fit/calibration.json")
  read -r rms blocks tilt < <(figures "$fit")
  best=- rms2=- blocks2=- tilt2=-
  if [ "$verdict" = missing ] || [ "$verdict" = ambiguous ]; then
    next=$work/$case/next
    mkdir -p "$next"
    cp "$data/$case/model.toml" "$next/start.toml"
    chmod u+w "$next/start.toml"
    best=$(jq -r '.missing as $named | [.candidates[] | select(.effect as $e | $named | index($e))][0].effect' "$fit/diagnosis.json")
    tool model add "$best" "$next/start.toml"
    tool calibrate "$data/$case" "$mesh" --method least-squares --model "$next/start.toml" --threads 1 -o "$next"
    read -r rms2 blocks2 tilt2 < <(figures "$next")
  fi
  echo "| $case | $verdict | $named | $best | $rms | $rms2 | $blocks | $blocks2 | $tilt | $tilt2 | $noise |"
done
