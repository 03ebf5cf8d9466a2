#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The study's ligament designs (F5) on a case whose truth has a full ring: full ring against a thinner, incomplete one
# at the same parameters, and without any. Where does the error sit?
#
#   bench/study_ligament.sh DATA/hidden-open WORK [BIN]
source "$(dirname "$0")/study_common.sh"
case=ligament-1
mesh=$(mesh_of $case $default_triangles)
base=$work/designs
mkdir -p "$base/full"
cp "$data/$case/model.toml" "$base/full.start.toml"
chmod u+w "$base/full.start.toml"
tool model add ligament "$base/full.start.toml"
tool calibrate "$data/$case" "$mesh" --method least-squares --model "$base/full.start.toml" --threads 1 -o "$base/full"
sed 's/^width_mm = [0-9.]*/width_mm = 6/; s/^arc = .*/arc = "open_medial"/' "$base/full/model.toml" >"$base/thin.toml"
cp "$base/full/model.toml" "$base/none.toml"
tool model remove ligament "$base/none.toml"
jq -r '"Fixed at: " + ([.parameters[] | "\(.name) \(.value * 1000 | round / 1000)"] | join(", "))' "$base/full/calibration.json"
echo
echo "| ligament | MAE (study), mm | RMS, mm | worst areas, MAE in mm |"
echo "|---|---|---|---|"
for design in full thin none; do
  model=$base/$design.toml
  [ $design = full ] && model=$base/full/model.toml
  tool simulate "$data/$case" "$mesh" --model "$model" --pose supine -o "$base/$design.run"
  tool compare "$data/$case" "$base/$design.run/supine.vtu" --model "$model" -o "$base/$design.run"
  jq -r --arg design $design 'def r2: . * 100 | round / 100;
    "| \($design) | \(.mae_study_mm | r2) | \(.rms_mm | r2) | \([.areas[] | select(.mae_mm)] | sort_by(-.mae_mm)[:4] | map("\(.name) \(.mae_mm | r2)") | join(", ")) |"' \
    "$base/$design.run/comparison.json"
done
