#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Prints the figures of one case from the sidecars in the folder OUT: summary.sh OUT [COMPARISON.vtp…]
# Only the comparisons named are shown: others in the folder are left over from an earlier case file.
set -euo pipefail
out=${1:?which output folder?}
imaged=${IMAGED:-prone} predicted=${PREDICTED:-supine} # names of the poses
shift

# figure FILE JQ-EXPRESSION: the value, "-" when the file or the key is not there.
figure() { if [ -f "$out/$1" ]; then jq -r "($2) // \"-\"" "$out/$1"; else echo "-"; fi; }
# row NAME UNIT FORMAT VALUE
row() {
  local value=$4
  if [ "$value" != "-" ]; then
    # shellcheck disable=SC2059
    value=$(LC_ALL=C printf "$3" "$value")
  fi
  printf '  %-34s %12s %s\n' "$1" "$value" "$2"
}

echo
echo "Figures of $out"
if [ -f "$out/labels.json" ]; then
  jq -r '.volume_ml // {} | to_entries[] | select(.value > 0 and .key != "air") | [.key, .value] | @tsv' "$out/labels.json" |
    while IFS=$'\t' read -r tissue ml; do row "$tissue" ml %.1f "$ml"; done
fi
row "triangles, reconstructed" "" %d "$(figure breast.json .triangles)"
row "triangles, decimated" "" %d "$(figure coarse.json .triangles)"
row "tetrahedra" "" %d "$(figure mesh.json .cells)"
if [ "$imaged" != undeformed ]; then
  row "sag, undeformed to $imaged, most" mm %.2f "$(figure "$imaged.json" .displacement_from_undeformed_mm.max)"
fi
row "sag, undeformed to $predicted, most" mm %.2f "$(figure "$predicted.json" .displacement_from_undeformed_mm.max)"
if [ "$imaged" != undeformed ]; then
  row "way from $imaged to $predicted, most" mm %.2f "$(figure "$predicted.json" .displacement_from_prone_mm.max)"
  row "round trip to the imaged shape" mm %.1e "$(figure "$predicted.json" .round_trip_max_mm)"
else
  echo "  imaged free of load: no inverse, no round trip"
fi
if [[ " $* " == *"/comparison.vtp "* ]] && [ -f "$out/comparison.json" ]; then
  row "MAE, model to scan (the study's)" mm %.2f "$(figure comparison.json .mae_study_mm)"
  row "MAE, scan to model" mm %.2f "$(figure comparison.json .mae_mm)"
  row "RMS" mm %.2f "$(figure comparison.json .rms_mm)"
  row "95th percentile" mm %.2f "$(figure comparison.json .p95_mm)"
  row "maximum" mm %.2f "$(figure comparison.json .hausdorff_mm)"
  row "scanner noise, 1 sigma" mm %.2f "$(figure comparison.json .noise_mm)"
fi
for comparison in "$@"; do
  file=${comparison%.vtp}.json
  if [[ "$comparison" == */comparison_* ]] && [ -f "$file" ]; then row "RMS, pose $(jq -r .pose "$file")" mm %.2f "$(jq -r .rms_mm "$file")"; fi
done
echo
echo "For ParaView, in $out:"
for file in labels.vti breast.vtp muscle.vtp coarse.vtp mesh.vtu "${imaged/undeformed/-}.vtu" undeformed.vtu "$predicted.vtu" \
  prone_tumour.vtp supine_tumour.vtp; do
  if [ -f "$out/$file" ]; then printf '  %s\n' "$file"; fi
done
for comparison in "$@"; do
  name=${comparison##*/}
  printf '  %s %s\n' "$name" "${name/comparison/scan}"
done
