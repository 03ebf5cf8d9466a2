// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace supine {

/// The name of @p known that is closest to @p name by edit distance (a swap of neighbours is one edit); empty when
/// none is close (more than a third of the letters differ).
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

/// "did you mean NAME?" with the nearest name, or else "known here: a, b or c".
std::string suggestion(std::string_view name, const std::vector<std::string>& known);

/// "a", "a or b", "a, b or c".
std::string listed(const std::vector<std::string>& names);

}  // namespace supine
