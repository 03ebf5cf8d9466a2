#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Discretisation error on the skin: one computed breast at the generator's own moduli on meshes of several kinds, each
# against the scan and against the last one that could be solved. Prints a table (docs/verification.md).
#
#   bench/mesh_error.sh DATA/hidden-open CASE WORK [BIN]
source "$(dirname "$0")/mesh_common.sh"

# solve LABEL TRIANGLES MAX_DISTANCE_MM OPTIONS…: meshes, solves, compares; one line.
poses=()
solve() {
  local label=$1 triangles=$2 distance=$3 out=$work/$1
  mkdir -p "$out"
  tool decimate "$work/breast.vtp" --triangles "$triangles" --max-distance-mm "$distance" -o "$out/coarse.vtp"
  tool tetrahedralise "$out/coarse.vtp" "$work/muscle.vtp" "$work/labels.vti" -o "$out/mesh.vtu" "${@:4}"
  TIMEFORMAT=%U
  if ! { time tool simulate "$case" "$out/mesh.vtu" --model "$work/truth.toml" --pose supine --threads 1 -o "$out"; } 2>"$out/user_s" ||
    [ ! -e "$out/supine.vtu" ]; then
    printf '%-28s %7s  no result, see %s\n' "$label" "$(jq .nodes "$out/mesh.json")" "$work/messages.txt"
    return 0
  fi
  tool compare "$case" "$out/supine.vtu" -o "$out"
  poses+=("$out/supine.vtu")
  printf '%-28s %7s %8.1f %7.3f %9.2f\n' "$label" "$(jq .nodes "$out/mesh.json")" \
    "$(cat "$out/user_s")" "$(jq .rms_mm "$out/comparison.json")" \
    "$(jq '[.landmarks[].error_mm] | add / length' "$out/comparison.json")"
}

printf '%-28s %7s %8s %7s %9s\n' mesh nodes 'user s' RMS landmarks
solve linear-1300 1300 1
solve linear-2500 2500 1
solve linear-6000 6000 1
solve linear-2500-edge-3.5 2500 1 --skin-edge-mm 3.5
solve linear-2500-edge-1.75 2500 1 --skin-edge-mm 1.75
solve straight-1300 1300 3 --order 2
solve curved-1300 1300 3 --order 2 --fine "$work/breast.vtp"
solve curved-1300-edge-4.8 1300 3 --order 2 --fine "$work/breast.vtp" --skin-edge-mm 4.8
last=$((${#poses[@]} - 1))
"$bin/bench_mesh_error" "${poses[$last]}" "${poses[@]:0:$last}"
