#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The study's Monte Carlo (F4): 1000 draws around its optimum, with positive priors and with its own normal laws, on all
# cores; histogram in sensitivity.png.
#
#   bench/study_sensitivity.sh DATA/hidden-open WORK [BIN] [SAMPLES]
source "$(dirname "$0")/study_common.sh"
samples=${4:-1000}
case=null-1
mesh=$(mesh_of $case $study_triangles)
with_moduli "$data/$case/model.toml" "$work/study_spread.toml" 0.32 0.4 23 40
echo "Mesh: $(size_of "$mesh"); $cores threads; $samples draws"
echo
echo "| law | MAE mean ± sd, mm | 5 % to 95 % | without equilibrium | refused draws | share of E_breast, E_skin, both together | s | s per run and thread |"
echo "|---|---|---|---|---|---|---|---|"
for law in prior normal; do
  tool sensitivity "$data/$case" "$mesh" --model "$work/study_spread.toml" --samples "$samples" --law $law \
    --threads "$cores" -o "$work/sensitivity_$law.csv"
  jq -r --arg law $law '
    def r2: . * 100 | round / 100;
    def at($q): .quantiles[] | select(.share == $q) | .mae_study_mm | r2;
    "| \($law) | \(.mae_study_mm.mean | r2) ± \(.mae_study_mm.sd | r2) | \(at(0.05)) to \(at(0.95)) | \(.failed_solves) | \(.refused_draws) | \(.parameters[0].variance_share | r2), \(.parameters[1].variance_share | r2), \(.interaction_share | r2) | \(.timing.stages_s.runs | round) | \(.timing.stages_s.runs * .timing.threads / .samples | r2) |"' \
    "$work/sensitivity_$law.json"
done
"$here/study_histogram.py" "$work/sensitivity.png" "$work"/sensitivity_{prior,normal}.csv
