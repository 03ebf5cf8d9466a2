#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The study's Monte Carlo (F4): 1000 draws around its optimum, with positive priors and with its own normal laws.
#
#   bench/study_sensitivity.sh DATA/hidden-open WORK [BIN] [TRIANGLES] [SAMPLES]
source "$(dirname "$0")/study_common.sh"
samples=${5:-1000}
case=null-1
mesh_of $case
with_moduli "$data/$case/model.toml" "$work/study_spread.toml" 0.32 0.4 23 40
for law in prior normal; do
  tool sensitivity "$data/$case" "$work/$case/mesh.vtu" --model "$work/study_spread.toml" --samples "$samples" --law $law \
    -o "$work/sensitivity_$law.csv"
  jq -r --arg law $law '"\($law): MAE \(.mae_study_mm.mean) ± \(.mae_study_mm.sd) mm, \(.failed_solves) without equilibrium, \(.refused_draws) draws refused, shares \([.parameters[] | "\(.name) \(.variance_share)"] | join(", ")), \(.timing.stages_s.runs) s"' \
    "$work/sensitivity_$law.json"
done
