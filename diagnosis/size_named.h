// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// How many times its usual size an effect would have to be to be named in a share of such measurements, were it all
/// that is missing and its rivals no likelier than before: along lines, under all errors at the base fit
/// (size_that_reaches). Infinite where the points do not show it at all.
double size_named(const Findings& found, const Score& score, double share);

}  // namespace supine::diagnosis
