#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The eight computed breasts with a known answer: each case with the model it comes with, and with the generator's own
# moduli. Prints a table (docs/verification.md).
#
#   bench/hidden_cases.sh DATA/hidden-open WORK [BIN] [TRIANGLES] [ORDER]
set -euo pipefail
data=${1:?folder with the cases and answers/}
work=${2:?folder for the results}
bin=${3:-build/bin}
triangles=${4:-2500}
order=${5:-1}

# tool NAME ARGUMENTS…: exit code 1 (written, a target was not met) does not stop the run.
tool() { "$bin/supine-$1" "${@:2}" --force --quiet 2>>"$work/messages.txt" || [ $? -eq 1 ]; }
figure() { jq -r "$2" "$1"; }

mkdir -p "$work"
: >"$work/messages.txt"
printf '%-22s %-9s %6s %6s %6s %6s %6s %9s %9s %8s\n' case moduli MAEst MAE RMS p95 signed tilt-RMS landmarks round-trip
for case in "$data"/*/; do
  name=$(basename "$case")
  [ -f "$case/case.toml" ] || continue
  out=$work/$name
  mkdir -p "$out"
  tool segment "$case" -o "$out/labels.vti"
  tool reconstruct "$out/labels.vti" -o "$out"
  tool decimate "$out/breast.vtp" --triangles "$triangles" -o "$out/coarse.vtp"
  tool tetrahedralise "$out/coarse.vtp" "$out/muscle.vtp" "$out/labels.vti" --order "$order" -o "$out/mesh.vtu"
  answer=$data/answers/$name.json
  for moduli in start truth; do
    cp "$case/model.toml" "$out/$moduli.toml"
    if [ $moduli = truth ]; then
      breast=$(figure "$answer" .parameters.Eb) skin=$(figure "$answer" .parameters.Es)
      sed -i "/^\[breast\]/,/^\[skin\]/s/value = [0-9.]*/value = $breast/; /^\[skin\]/,/^\[interface\]/s/value = [0-9.]*/value = $skin/" \
        "$out/$moduli.toml"
    fi
    mkdir -p "$out/$moduli"
    tool simulate "$case" "$out/mesh.vtu" --model "$out/$moduli.toml" -o "$out/$moduli"
    tool compare "$case" "$out/$moduli/supine.vtu" -o "$out/$moduli"
    tilt=-
    if [ -f "$out/$moduli/tilt45.vtu" ] && grep -q tilt45.ply "$case/case.toml"; then
      tool compare "$case" "$out/$moduli/tilt45.vtu" -o "$out/$moduli"
      tilt=$(figure "$out/$moduli/comparison_tilt45.json" '.rms_mm * 100 | round / 100')
    fi
    result=$out/$moduli/comparison.json
    printf '%-22s %-9s %6.2f %6.2f %6.2f %6.2f %6.2f %9s %9.2f %8.0e\n' "$name" $moduli \
      "$(figure "$result" .mae_study_mm)" "$(figure "$result" .mae_mm)" "$(figure "$result" .rms_mm)" \
      "$(figure "$result" .p95_mm)" "$(figure "$result" .mean_signed_mm)" "$tilt" \
      "$(figure "$result" '[.landmarks[].error_mm] | add / length')" \
      "$(figure "$out/$moduli/supine.json" .round_trip_max_mm)"
  done
done
