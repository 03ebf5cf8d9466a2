#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The study's table 1 (F3): three starts, CMA-ES with ten seeds each, and least squares from the same starts.
# On a null (neo-Hookean, made by an independent program), and on data made with the study's own corotational law.
#
#   bench/study_table1.sh DATA/hidden-open WORK [BIN] [TRIANGLES] [SEEDS]
source "$(dirname "$0")/study_common.sh"
seeds=${5:-10}
case=null-1
mesh_of $case

# The same case with a scan that the study's law makes at the study's second optimum.
own=$work/own
mkdir -p "$own"
cp -r "$data/$case/." "$own/"
chmod -R u+w "$own"
sed -i 's/^law = .*/law = "corotational"/' "$own/model.toml"
with_moduli "$own/model.toml" "$work/own_truth.toml" 0.5 0.1 22.72 1
mkdir -p "$work/own_run"
if tool simulate "$own" "$work/$case/mesh.vtu" --model "$work/own_truth.toml" --pose supine -o "$work/own_run" &&
  [ -f "$work/own_run/supine.vtu" ]; then
  tool compare "$own" "$work/own_run/supine.vtu" -o "$work/own_run"
  cp "$work/own_run/comparison.vtp" "$own/supine_own.vtp"
  sed -i 's/^surface = "supine.ply"/surface = "supine_own.vtp"/' "$own/case.toml"
else
  echo "the study's law has no equilibrium on this shape; see messages.txt" >&2
  own=
fi

printf '%-8s %-24s %-6s %6s %14s %14s %16s %10s %9s\n' data start method runs 'E_breast' 'E_skin' 'MAE, mm' evaluations seconds
row() { # DATA START METHOD FILES…
  jq -rs --arg data "$1" --arg start "$2" --arg method "$3" '
    def mean: add / length; def sd: (mean) as $m | (map((. - $m) * (. - $m)) | add / ([length - 1, 1] | max)) | sqrt;
    def r(n): . * pow(10; n) | round / pow(10; n);
    def both(n): "\(mean | r(n)) ± \(sd | r(n))";
    [$data, $start, $method, length, (map(.parameters[0].value) | both(3)), (map(.parameters[1].value) | both(1)),
     (map(.mae_study_mm) | both(3)), (map(.evaluations) | mean | r(1)), (map(.timing.stages_s.fit) | mean | r(1))] | @tsv' "${@:4}" |
    while IFS=$'\t' read -r -a f; do printf '%-8s %-24s %-6s %6s %14s %14s %16s %10s %9s\n' "${f[@]}"; done
}
for kind in null $([ -n "$own" ] && echo own); do
  folder=$data/$case
  [ $kind = own ] && folder=$own
  for start in '0.3 0.1 75 50' '0.3 0.3 75 100' '1.5 1.5 120 100'; do
    read -r eb sb es ss <<<"$start"
    name="$eb±$sb, $es±$ss"
    base=$work/table1/$kind-$eb-$sb
    mkdir -p "$base"
    with_moduli "$folder/model.toml" "$base/start.toml" "$eb" "$sb" "$es" "$ss"
    files=()
    for seed in $(seq "$seeds"); do
      tool calibrate "$folder" "$work/$case/mesh.vtu" --model "$base/start.toml" --method cmaes --seed "$seed" -o "$base/cma$seed" &&
        [ -f "$base/cma$seed/calibration.json" ] && files+=("$base/cma$seed/calibration.json")
    done
    [ ${#files[@]} -gt 0 ] && row $kind "$name" cmaes "${files[@]}"
    tool calibrate "$folder" "$work/$case/mesh.vtu" --model "$base/start.toml" --no-priors -o "$base/ls" &&
      [ -f "$base/ls/calibration.json" ] && row $kind "$name" ls "$base/ls/calibration.json"
  done
done
