#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# A silicone bar on a coarse mesh, to its report, and that in a browser: object_page_test.sh BIN SAMPLES. Exit code 77: skipped.
set -euo pipefail
here=$(dirname "$0") bin=$1 samples=$2
report=${VIEW3D:?the bundled 3-D view}
command -v node >/dev/null || { echo "skipped: no node here (apt-get install nodejs)"; exit 77; }
command -v chromium >/dev/null || command -v "${SUPINE_CHROMIUM:-chromium}" >/dev/null || { echo "skipped: no chromium here"; exit 77; }
[ -s "$report" ] || { echo "skipped: supine-report was built without the 3-D view (npm could not fetch vtk.js)"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp -r "$samples/silicone_bar" "$folder/bars"
env -u MAKEFLAGS -u MAKELEVEL make -f "$here/../../../pipeline/Makefile" BIN="$bin" CASE="$folder/bars/joined" OUT="$folder/out" EDGE_MM=15 THREADS=2 calibrate >"$folder/said" 2>&1 ||
  { cat "$folder/said"; exit 1; }
"$bin/supine-diagnose" "$folder/bars/joined" "$folder/out/mesh.vtu" --model "$folder/out/model.toml" --no-other-meshes --threads 2 -o "$folder/out" --force >>"$folder/said"
"$bin/supine-report" "$folder/bars/joined" --dir "$folder/out" -o "$folder/out/report.html" --force >>"$folder/said"
# Names of files and options stay what they are.
if sed -E '/^supine-[a-z]+ [0-9.]+: /d; s/muscle\.vtp//g' "$folder/said" | grep -n -i -E '\b(nipple|quadrant|muscle|lateral|prone|patient)\b'; then echo "the tools speak of a breast"; exit 1; fi
timeout 200 node "$here/object_page_test.mjs" "$folder/out" ${3:+"$3"}
