#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Every table of docs/study.md, one after the other: half an hour or more on two cores; run it on a quiet machine.
#
#   bench/study.sh DATA/hidden-open WORK [BIN]
set -euo pipefail
here=$(dirname "$0")
if ! /usr/bin/python3 -c 'import matplotlib' 2>/dev/null; then
  echo "study: its pictures need matplotlib: apt-get install python3-matplotlib" >&2
  exit 2
fi
for part in recovery time ligament loop table1 sensitivity coverage; do
  printf '\n== %s\n\n' "$part"
  "$here/study_$part.sh" "$@"
done
echo
echo "Pictures: $2/ridge.png, $2/sensitivity.png"
