# SPDX-License-Identifier: AGPL-3.0-or-later
# How sanitizers run: sourced by run.sh, and by make before the build, which lists the tests of each executable.
# shellcheck shell=bash
sanitizers=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# A failed operator new ends the process under this sanitizer; malloc gives null, as other libraries expect.
export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=1
export LSAN_OPTIONS=suppressions=$sanitizers/leaks.txt:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1
# Libraries of the system are built without: what they do between themselves cannot be seen. Archer tells the sanitizer
# of the barriers of OpenMP.
export TSAN_OPTIONS=ignore_noninstrumented_modules=1:halt_on_error=1:die_after_fork=0
