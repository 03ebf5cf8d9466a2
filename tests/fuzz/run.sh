#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# run.sh BUILD SECONDS SEED [TARGET ...]: every reader, or those named, for that long each, from the seeds and from what
# earlier runs found (BUILD/corpus). SEED 0: another one each time. Inputs that bring a reader down stay in
# BUILD/findings/TARGET; the exit code is 1 then.
set -euo pipefail
build=$1 seconds=$2 seed=$3
shift 3
fuzzer=$build/bin/fuzz_readers
"$build/bin/write_seeds" "$build/seeds"
targets=("$@")
((${#targets[@]})) || mapfile -t targets < <(ls "$build/seeds")
[ ! -w /dev/shm ] || export TMPDIR=/dev/shm
# What VTK and GDCM never give back is theirs.
export ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1:handle_abort=1 UBSAN_OPTIONS=print_stacktrace=1
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
failed=()
for target in "${targets[@]}"; do
  mkdir -p "$build/corpus/$target" "$build/findings/$target"
  log=$build/findings/$target.log
  # One finding ends a reader, so that each is looked at. No limit of resident memory: the thread that watches it may hold a
  # lock when a trial process (common/trial_process.h) is forked, which then never ends.
  if ! "$fuzzer" --target="$target" -max_total_time="$seconds" -seed="$seed" -timeout=30 -rss_limit_mb=0 \
    -malloc_limit_mb=3000 -max_len=20000 -print_final_stats=1 -artifact_prefix="$build/findings/$target/" \
    "$build/corpus/$target" "$build/seeds/$target" >"$log" 2>&1; then
    failed+=("$target")
    echo "$target: brought down; see $log and $build/findings/$target" >&2
  fi
  echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs," \
    "$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -1) edges"
done
((${#failed[@]} == 0)) || exit 1
