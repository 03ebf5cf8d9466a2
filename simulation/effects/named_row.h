// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/suggestion.h"

namespace supine::simulation {

/// Row of what an effect's option names; of "first" the first, nothing where there are none at all.
/// @throws InputError  there is none of that name
inline std::optional<int> named_row(const std::vector<std::string>& names, const std::string& wanted,
                                    const std::string& effect, const std::string& option) {
  if (names.empty()) return std::nullopt;
  const auto found = std::find(names.begin(), names.end(), wanted);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  if (wanted == "first") return 0;
  throw InputError(fmt::format("effect '{}': {} = \"{}\" is none of this body's: {}", effect, option, wanted,
                               suggestion(wanted, names)));
}

}  // namespace supine::simulation
