#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# run.sh BUILD SECONDS INPUTS SEED [TARGET ...]: every reader, or those named, for that long or with that many inputs each
# (0: without that limit), from the seeds and from what earlier runs found (BUILD/corpus). SEED 0: another one each time.
# Inputs that bring a reader down stay in BUILD/findings/TARGET and are printed; the exit code is 1 then.
set -euo pipefail
build=$1 seconds=$2 inputs=$3 seed=$4
shift 4
fuzzer=$build/bin/fuzz_readers
"$build/bin/write_seeds" "$build/seeds"
targets=("$@")
((${#targets[@]})) || mapfile -t targets < <(ls "$build/seeds")
[ ! -w /dev/shm ] || export TMPDIR=/dev/shm
# What VTK and GDCM never give back is theirs.
sanitizer=detect_leaks=0:allocator_may_return_null=1:handle_abort=1
# Names and lines of a stack are looked up for findings alone: a trial process that dies would look them up each time.
export ASAN_OPTIONS=$sanitizer:symbolize=0 UBSAN_OPTIONS=print_stacktrace=1
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
failed=()
for target in "${targets[@]}"; do
  mkdir -p "$build/corpus/$target" "$build/findings/$target"
  log=$build/findings/$target.log
  # One finding ends a reader, so that each is looked at. An input may take longer than a trial process gets (300 s). No limit of resident memory: the thread that watches it may hold a
  # lock when a trial process (common/trial_process.h) is forked, which then never ends.
  if ! "$fuzzer" --target="$target" -max_total_time="$seconds" -seed="$seed" -timeout=330 -rss_limit_mb=0 \
    -runs="$((inputs > 0 ? inputs : -1))" -malloc_limit_mb=3000 -max_len=20000 -print_final_stats=1 -artifact_prefix="$build/findings/$target/" \
    "$build/corpus/$target" "$build/seeds/$target" >"$log" 2>&1; then
    failed+=("$target")
    finding=$(sed -n 's/.*Test unit written to //p' "$log" | tail -1)
    [ ! -f "$finding" ] || ASAN_OPTIONS=$sanitizer "$fuzzer" --target="$target" "$finding" >>"$log" 2>&1 || true
    echo "$target: brought down; see $log. Its end, and the input ($finding, base64):" >&2
    tail -n 60 "$log" | cut -c1-300 >&2
    [ ! -f "$finding" ] || base64 "$finding" >&2
  fi
  echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs," \
    "$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -1) edges"
done
((${#failed[@]} == 0)) || exit 1
