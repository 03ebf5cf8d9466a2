#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# The page of a made cohort in a real browser: page_test.sh PYTHON BIN [PICTURES]; exit code 77 (skipped) where one is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
command -v node >/dev/null || { echo "skipped: no node here (apt-get install nodejs)"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# A name is text, wherever it comes from; a link leads to the report.
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$here "$1" -c 'import made_cohort, sys; made_cohort.make(sys.argv[1], 100, 0.6, report="<p>the report</p>", failed=2)' "$work/cohort"
"$2/supine-cohort" "$work/cohort" --quiet
timeout 200 node "$here/page_test.mjs" "$work/cohort" "${@:3}"
