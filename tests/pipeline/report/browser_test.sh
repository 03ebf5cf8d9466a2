#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Runs browser_test.mjs; exit code 77 (skipped) where something it needs is not there.
set -euo pipefail
here=$(dirname "$0")
report=${VIEW3D:?the bundled 3-D view}
command -v node >/dev/null || { echo "skipped: no node here (apt-get install nodejs)"; exit 77; }
[ -s "$report" ] || { echo "skipped: supine-report was built without the 3-D view (npm could not fetch vtk.js)"; exit 77; }
exec timeout 200 node "$here/browser_test.mjs" "$@"
