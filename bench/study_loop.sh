#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The loop by hand: calibrate, diagnose, add the effect that is named first, calibrate again; does the error fall?
# Every case with a known answer (docs/study.md, loop).
#
#   bench/study_loop.sh DATA/hidden-open WORK [BIN] [TRIANGLES]
source "$(dirname "$0")/study_common.sh"
printf '%-20s %-16s %-40s %6s %6s %6s %6s %6s %6s\n' truth verdict named RMS then blocks then tilt then
for answer in "$data"/answers/*.json; do
  case=$(basename "$answer" .json)
  mesh_of "$case"
  fit=$work/$case/fit
  [ -f "$fit/calibration.json" ] || tool calibrate "$data/$case" "$work/$case/mesh.vtu" -o "$fit"
  tool diagnose "$data/$case" "$work/$case/mesh.vtu" --model "$fit/model.toml" -o "$fit"
  verdict=$(jq -r .verdict "$fit/diagnosis.json")
  named=$(jq -r '.missing | join(" ")' "$fit/diagnosis.json")
  figures() { jq -r '[.rms_mm, .held_out_rms_mm, .held_out.by_pose[0].rms_mm] | map(if . then . * 100 | round / 100 else "-" end) | @tsv' "$1/calibration.json"; }
  read -r rms blocks tilt < <(figures "$fit")
  rms2=- blocks2=- tilt2=-
  if [ "$verdict" = missing ] || [ "$verdict" = ambiguous ]; then
    next=$work/$case/next
    mkdir -p "$next"
    cp "$data/$case/model.toml" "$next/start.toml"
    chmod u+w "$next/start.toml"
    best=$(jq -r '[.candidates[] | select(.effect as $e | '"$(jq -c .missing "$fit/diagnosis.json")"' | index($e))][0].effect' "$fit/diagnosis.json")
    tool model add "$best" "$next/start.toml"
    tool calibrate "$data/$case" "$work/$case/mesh.vtu" --model "$next/start.toml" -o "$next"
    read -r rms2 blocks2 tilt2 < <(figures "$next")
    named="$best of ($named)"
  fi
  printf '%-20s %-16s %-40s %6s %6s %6s %6s %6s %6s\n' "$case" "$verdict" "$named" "$rms" "$rms2" "$blocks" "$blocks2" "$tilt" "$tilt2"
done
