#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# What the mesh does to the answer: the supine skin of one computed breast at the generator's own moduli on meshes of
# growing face count (linear; with short edges where the skin ends; sized by the error of a first solution; quadratic and bent; both), each against the finest.
# Writes WORK/mesh_choice.csv; bench/mesh_choice.py draws it (docs/meshing.md).
#
#   bench/mesh_choice.sh DATA/hidden-open CASE WORK [BIN]
#
# ROWS, a regular expression, takes some rows only, for example ROWS='^(linear-2500|reference-7000)$'.
# Results already in WORK are kept: an interrupted study goes on, a row is redone by deleting its folder.
source "$(dirname "$0")/mesh_common.sh"

# solve KIND TRIANGLES OPTIONS…: meshes, solves, compares with the scan; one row.
rows=()
solve() {
  local kind=$1 triangles=$2 out=$work/$1-$2
  [[ $kind-$triangles =~ ${ROWS:-.} ]] || return 0
  rows+=("$kind-$triangles")
  [ ! -e "$out/row.csv" ] || return 0
  mkdir -p "$out"
  tool decimate "$work/breast.vtp" --triangles "$triangles" --max-distance-mm 3 -o "$out/coarse.vtp"
  tool tetrahedralise "$out/coarse.vtp" "$work/muscle.vtp" "$work/labels.vti" -o "$out/mesh.vtu" "${@:3}"
  tool simulate "$case" "$out/mesh.vtu" --model "$work/truth.toml" --pose supine --threads 1 -o "$out" || true
  if [ ! -e "$out/supine.vtu" ]; then
    echo "$kind-$triangles: no result, see $work/messages.txt" >&2
    return 0
  fi
  tool compare "$case" "$out/supine.vtu" -o "$out"
  echo "$kind,$(jq .triangles "$out/mesh.json"),$(jq .nodes "$out/mesh.json"),$(jq .rms_mm "$out/comparison.json"),$(
    jq '[.landmarks[].error_mm] | add / length' "$out/comparison.json")" >"$out/row.csv"
  cat "$out/row.csv" >&2
}

# Edge of the coarse triangles over four, from the surface's area.
quarter() { awk "BEGIN {print 0.25 * sqrt(4 * $(jq '[.area_cm2[]] | add' "$work/breast.json") * 100 / (sqrt(3) * $1))}"; }

for n in 600 1300 2500 5000 10000; do solve linear "$n"; done
for n in 600 1300 2500 5000; do solve graded "$n" --skin-edge-mm "$(quarter "$n")"; done
for n in 10000 20000 40000; do solve by-error-$n 2500 --error-from "$work/linear-2500/supine.vtu" --cells "$n"; done
for n in 400 700 1300; do solve quadratic "$n" --order 2 --fine "$work/breast.vtp"; done
for n in 400 700; do
  solve both-half "$n" --order 2 --fine "$work/breast.vtp" --skin-edge-mm "$(awk "BEGIN {print 2 * $(quarter "$n")}")"
  solve both-quarter "$n" --order 2 --fine "$work/breast.vtp" --skin-edge-mm "$(quarter "$n")"
done
solve reference 7000 --skin-edge-mm "$(quarter 7000)"

reference=$work/reference-7000/supine.vtu
[ -e "$reference" ] || { echo "no $reference: run the row reference-7000 first" >&2; exit 1; }
echo "kind,triangles,nodes,scan_rms_mm,landmarks_mm,surface_rms_mm,surface_max_mm,marks_rms_mm" >"$work/mesh_choice.csv"
for row in "${rows[@]}"; do
  [ -e "$work/$row/row.csv" ] || continue
  difference=$("$bin/bench_mesh_error" "$reference" "$work/$row/supine.vtu" | tail -1 | awk '{print $2 "," $4 "," $6}')
  echo "$(cat "$work/$row/row.csv"),$difference" >>"$work/mesh_choice.csv"
done
echo "against $reference" >&2
column -s, -t "$work/mesh_choice.csv"
