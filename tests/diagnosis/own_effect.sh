#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Installs BUILD, builds samples/own_effect against it and runs its tools on a copy of the small case:
#   own_effect.sh SOURCE BUILD WORK SMALL_RUN
set -euo pipefail
source=$1 build=$2 work=$3 small=$4
rm -rf "$work"
mkdir -p "$work"
cmake --install "$build" --prefix "$work/installed" >"$work/install.log"
cmake -G Ninja -S "$source/samples/own_effect" -B "$work/own" -DCMAKE_PREFIX_PATH="$work/installed" >"$work/configure.log"
cmake --build "$work/own" --target supine-model supine-simulate supine-compare supine-calibrate supine-diagnose >"$work/build.log" ||
  { tail -40 "$work/build.log"; exit 1; }
bin=$work/own/bin
cp -a "$small" "$work/case"
cd "$work/case"

# The plain tools do not know it, ours do.
if "$build/bin/supine-model" add scar model.toml --quiet 2>/dev/null; then echo "a plain tool knows the scar"; exit 1; fi
"$bin/supine-diagnose" . out/mesh.vtu --model model.toml -o found --refit 1 --quiet
jq -e '[.candidates[].effect] | index("table_offset")' found/diagnosis.json >/dev/null || { echo "the table is no candidate"; exit 1; }
jq -e '[.candidates[].effect] | index("scar")' found/diagnosis.json >/dev/null || { echo "the scar is no candidate"; exit 1; }
"$bin/supine-simulate" . out/mesh.vtu --model model.toml -o before --quiet
"$bin/supine-model" add scar model.toml --force --quiet
"$bin/supine-simulate" . out/mesh.vtu --model model.toml -o after --quiet
if cmp -s before/supine.vtu after/supine.vtu; then echo "the scar changes nothing"; exit 1; fi
"$bin/supine-calibrate" . out/mesh.vtu --model model.toml -o fit --quiet || [ $? -eq 1 ]
jq -e '[.parameters[].name] | index("scar.log_ratio")' fit/calibration.json >/dev/null || { echo "the scar is not fitted"; exit 1; }

# A cause of the measurement moves the scan, not the body: 5 mm along y change what is compared, not what is simulated.
"$bin/supine-compare" . before/supine.vtu -o apart --quiet
"$bin/supine-model" remove scar model.toml --force --quiet
"$bin/supine-model" add table_offset model.toml --force --quiet
sed -i 's/^height_mm = .*/height_mm = 5/' model.toml
"$bin/supine-simulate" . out/mesh.vtu --model model.toml -o table --quiet
cmp -s before/supine.vtu table/supine.vtu || { echo "the table changes a shape"; exit 1; }
"$bin/supine-compare" . table/supine.vtu --model model.toml -o moved --quiet
jq -en --slurpfile a apart/comparison.json --slurpfile b moved/comparison.json '($a[0].rms_mm - $b[0].rms_mm) | fabs > 0.2' >/dev/null ||
  { echo "the table moves no scan"; exit 1; }
