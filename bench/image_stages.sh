#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# CPU seconds and most memory of every stage from labels to tetrahedra on the 0.2 mm phantom (374 x 448 x 449 voxels),
# beside marching cubes, smoothing and quadric decimation of VTK on the same labels. Prints the table of docs/imaging.md.
#
#   bench/image_stages.sh DATA WORK [BIN]        DATA holds phantoms/victre_p_1_0p2mm.nrrd
set -euo pipefail
data=$(realpath "${1:?folder with phantoms}")
work=${2:?folder for the results}
bin=${3:-build/bin}
volume=$data/phantoms/victre_p_1_0p2mm.nrrd
[ -e "$volume" ] || { echo "$volume is not there"; exit 2; }
mkdir -p "$work"
cat >"$work/case.toml" <<TOML
[case]
name = "fine phantom"
frame = "LPS"
side = "left"
[image]
file = "$volume"
kind = "labels"
cut = ["edge", "rim"]
rim_mm = 10
[image.labels]
air = [0]
adipose = [1]
gland = [29, 95, 125]
skin = [2]
muscle = [40]
nipple = [33]
vessel = [150, 225]
ligament = [88]
[pose.prone]
gravity = [1.0, 0.0, 0.0]
[pose.supine]
gravity = [-1.0, 0.0, 0.0]
TOML

# row NAME COMMAND…: exit code 1 (written, a target was not met) does not stop the run
row() {
  local name=$1 code=0
  shift
  /usr/bin/time -o "$work/time" -f '%e %U %S %M' "$@" >"$work/last.log" 2>&1 || code=$?
  [ $code -le 1 ] || { tail -n 3 "$work/last.log"; exit $code; }
  tail -n 1 "$work/time" |
    awk -v n="$name" '{printf "| %s | %.1f | %.1f | %.0f |\n", n, $1, $2 + $3, $4 / 1024}'
}

echo '| stage | wall s | user + system s | most memory MB |'
echo '|---|---|---|---|'
row 'supine-segment (labels)' "$bin/supine-segment" "$work" -o "$work/labels.vti" --force
row 'supine-reconstruct (breast, muscle, organs)' "$bin/supine-reconstruct" "$work/labels.vti" -o "$work" --force
row 'supine-decimate (4000 triangles, 1 mm)' "$bin/supine-decimate" "$work/breast.vtp" --triangles 4000 --max-distance-mm 1 --force
row 'supine-tetrahedralise' "$bin/supine-tetrahedralise" "$work/coarse.vtp" "$work/muscle.vtp" "$work/labels.vti" --force
row 'VTK: flying edges, windowed sinc (breast alone)' "$bin/bench_vtk_surface" "$work/labels.vti" "$work/vtk.vtp"
row 'VTK: the same and quadric decimation to 4000' "$bin/bench_vtk_surface" "$work/labels.vti" "$work/vtk.vtp" 4000
