#!/bin/bash
# SPDX-License-Identifier: AGPL-3.0-or-later
# How often the 95 % intervals hold the truth when errors are drawn (bench/interval_coverage.cpp).
#
#   bench/study_coverage.sh DATA/hidden-open WORK [BIN] [DRAWS]
source "$(dirname "$0")/study_common.sh"
mesh=$(mesh_of null-1 $default_triangles)
"$bin/bench_interval_coverage" "$data/null-1" "$mesh" "${4:-200}"
