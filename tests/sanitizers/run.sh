#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# run.sh BUILD [--short] [TEST ...]: every test of a build under sanitizers, or the test executables named, whole, two at
# a time; --short leaves out what long.txt names. The exit code is 1 when one fails.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
shift
# shellcheck source=options.sh
source "$here/options.sh"
[[ $build != *-threads ]] || export OMP_NUM_THREADS=4
cc -shared -fPIC -o "$build/keep_libraries.so" "$here/keep_libraries.c"
filter='*'
if [ "${1:-}" = --short ]; then
  filter="-$(paste -sd: "$here/long.txt")"
  shift
fi
if (($# == 0)); then LD_PRELOAD=$build/keep_libraries.so exec ctest --test-dir "$build" --output-on-failure --parallel 2; fi

logs=$build/sanitizer-logs
mkdir -p "$logs"
one() {
  local began=$SECONDS log=$2/$4.log
  if LD_PRELOAD=$1/keep_libraries.so "$1/bin/$4" --gtest_brief=1 --gtest_filter="$3" >"$log" 2>&1; then
    echo "$4: clean, $((SECONDS - began)) s"
  else
    echo "$4: FAILED after $((SECONDS - began)) s; the end of $log:" && tail -n 60 "$log"
    return 1
  fi
}
export -f one
printf '%s\n' "$@" | xargs -P 2 -I{} bash -c 'one "$@"' - "$build" "$logs" "$filter" {} || exit 1
