# Writes TARGET with the version and the commit of SOURCE, touching it only when they changed.
execute_process(COMMAND git -C ${SOURCE} describe --always --abbrev=12 --dirty --exclude=*
                OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
file(CONFIGURE OUTPUT ${TARGET} CONTENT [[
// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/provenance.h"

namespace supine::pipeline {

std::string_view supine_version() { return "@VERSION@"; }
std::string_view supine_commit() { return "@commit@"; }

}  // namespace supine::pipeline
]] @ONLY)
