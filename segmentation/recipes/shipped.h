// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

namespace supine::segmentation {

/// A recipe that comes with the program, known by its name.
struct ShippedRecipe {
  std::string_view name;   ///< "t1_auto"
  std::string_view about;  ///< a line for a person
  std::string_view text;   ///< the TOML file, with its table [segmentation]
};

/// In the order in which they are listed to a person.
const std::vector<ShippedRecipe>& shipped_recipes();

/// @return nullptr for a name that no shipped recipe has
const ShippedRecipe* shipped_recipe(std::string_view name);

}  // namespace supine::segmentation
