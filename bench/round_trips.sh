#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Round trip prone → undeformed → prone by the true inverse, by the fixed point and by reversed gravity: the samples, the
# eight computed breasts and the half ellipsoid with the study's numbers. Prints the tables of docs/verification.md.
#
#   bench/round_trips.sh DATA WORK [BIN] [TRIANGLES]        DATA holds hidden-open/ and meshes/; may be absent
set -euo pipefail
data=${1:?folder with hidden-open and meshes}
work=${2:?folder for the results}
bin=${3:-build/bin}
triangles=${4:-2500}
export OPENBLAS_CORETYPE=${OPENBLAS_CORETYPE:-SkylakeX}
mkdir -p "$work"
: >"$work/messages.txt"

# tool NAME ARGUMENTS…: exit code 1 (written, a target was not met) does not stop the run.
tool() { "$bin/supine-$1" "${@:2}" --force --quiet 2>>"$work/messages.txt" || [ $? -eq 1 ]; }

# round_trip CASE METHOD: "max / rms mm, Newton steps" or why there is none
round_trip() {
  local out=$work/$(basename "$1")
  if tool simulate "$1" "$out/mesh.vtu" --inverse "$2" -o "$out/$2"; then
    jq -r '"\(.round_trip_max_mm | . * 1e15 | round / 1e15) mm, \(.newton_iterations) steps"' "$out/$2/supine.json"
  else
    echo 'none'
  fi
}

echo '| case | true inverse | fixed point | reversed gravity |'
echo '|---|---|---|---|'
for case in samples/*/ "$data"/hidden-open/*/; do
  [ -f "$case/case.toml" ] || continue
  out=$work/$(basename "$case")
  mkdir -p "$out"
  tool segment "$case" -o "$out/labels.vti"
  tool reconstruct "$out/labels.vti" -o "$out"
  tool decimate "$out/breast.vtp" --triangles "$triangles" -o "$out/coarse.vtp"
  tool tetrahedralise "$out/coarse.vtp" "$out/muscle.vtp" "$out/labels.vti" -o "$out/mesh.vtu"
  echo "| $(basename "$case") | $(round_trip "$case" newton) | $(round_trip "$case" fixed-point) | $(round_trip "$case" reversed-gravity) |"
done

ellipsoid=$data/meshes/breast_3k.vtk
[ -f "$ellipsoid" ] || { echo "no $ellipsoid: half ellipsoid skipped"; exit 0; }
echo
echo '| half ellipsoid: E kPa, law, skin 22.7 kPa | true inverse | fixed point | reversed gravity |'
echo '|---|---|---|---|'
for run in "1 corotational_qr" "1 corotational" "1 neo_hookean" "0.32 corotational_qr" "0.32 corotational" "0.32 neo_hookean"; do
  read -r young law <<<"$run"
  printf '| %s, %s |' "$young" "$law"
  for method in newton fixed-point reversed-gravity; do
    if line=$("$bin/bench_half_ellipsoid" "$ellipsoid" - "$young" "$law" 22.7 --round-trip "$method" 2>&1); then
      printf ' %s |' "$(sed -n 's/.*round trip \(.*\) mm max, \(.*\) rms.*/\1 \/ \2/p' <<<"$line")"
    else
      printf ' %s |' "$(sed -n 's/.*no equilibrium found beyond \([0-9]* %\).*/stops at \1/p; s/.*still \([^ ]*\) mm off.*/\1 mm after 60 corrections/p' <<<"$line" | head -1)"
    fi
  done
  echo
done
