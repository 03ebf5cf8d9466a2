#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# Runs one stage of one case of a cohort through the case's Makefile and keeps what was said:
#   run_stage.sh CASE OUT STAGE [VARIABLE=VALUE]...
# OUT/cohort/STAGE.log holds the output. A failure is noted in OUT/failed.txt, "STAGE: message", until the stage succeeds.
set -uo pipefail
case_folder=$1 out=$2 stage=$3
shift 3
here=$(cd "$(dirname "$0")" && pwd)
# One log for each part of the draws.
part=""
for word in "$@"; do if [[ "$word" == DRAWS=* ]]; then part=-${word#DRAWS=}; fi; done
log=$out/cohort/$stage$part.log
mkdir -p "$out/cohort"
# Make must not hand its job server down: each stage takes the threads it was given.
env -u MAKEFLAGS -u MAKELEVEL make --no-print-directory -f "$here/../pipeline/Makefile" CASE="$case_folder" OUT="$out" "$@" "$stage" >"$log" 2>&1
code=$?
if ((code == 0)); then
  if [ -f "$out/failed.txt" ] && [[ "$(<"$out/failed.txt")" == "$stage$part: "* ]]; then rm -f "$out/failed.txt"; fi
  exit 0
fi
if grep -q -e 'Error 130' -e 'Interrupt$' "$log" || ((code >= 128)); then exit 130; fi
# The tool's own message; else what make said of its end, which after a kill is all there is.
message=$(awk 'found && /^(make|supine-|==)/ { exit } sub(/^supine-[a-z]+: error: /, "") { found = 1 } found' "$log" | tr '\n' ' ' | sed 's/ *$//')
if [ -z "$message" ]; then message=$(grep -v '^[[:space:]]*$' "$log" | tail -n 1); fi
if grep -q -e 'Killed' -e 'Error 137' "$log"; then message="killed, most likely because it needed more memory than it was given"; fi
echo "$stage$part: ${message:-ended with code $code}" >"$out/failed.txt"
echo "cohort: ${case_folder##*/}: $(<"$out/failed.txt") (all it said: $log)" >&2
exit "$code"
