// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <string>

#include "segmentation/recipe.h"

namespace supine::segmentation {

/// Reads the table `[segmentation]` of a case file. The keys are those of docs/supine-segment.md.
/// @param place  how messages name the table, for example "case.toml [segmentation]"
/// @param frame  LPS or RAS: of the coordinates in the table (case.frame); the recipe returned is LPS
/// @throws InputError  naming place, line, key, value and bound: unknown key or step, wrong type, value out of range
Recipe read_recipe(const toml::table& table, const std::string& place, const std::string& frame = "LPS");

/// Reads a recipe file: the same `[segmentation]` table in a file of its own.
/// @throws InputError  as above, and for a file that cannot be read or is not TOML
Recipe read_recipe_file(const std::filesystem::path& file, const std::string& frame = "LPS");

}  // namespace supine::segmentation
