#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Says how many cases of a cohort are done and names those set aside: summary.sh OUT...
# Exit code 1 when some are.
set -uo pipefail
failed=0
for out in "$@"; do
  [ -f "$out/failed.txt" ] || continue
  ((failed == 0)) && echo "Set aside:"
  failed=$((failed + 1))
  name=${out%/out}
  echo "  ${name##*/}: $(<"$out/failed.txt")"
done
echo "$(($# - failed)) of $# cases done$( ((failed == 0)) || echo ", $failed set aside; correct what is said of them and run the same command again")"
((failed == 0))
