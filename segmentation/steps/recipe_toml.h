// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/toml_reader.h"
#include "segmentation/steps/recipe.h"

namespace supine::segmentation {

/// Reads the table `[segmentation]` of a case file: steps, or `recipe`, the name of one that comes with the program.
/// The keys are those of docs/supine-segment.md.
/// @param frame  LPS or RAS: of the coordinates in the table (case.frame); the recipe returned is LPS
/// @throws InputError  naming file, line, step, key, value and bound (and the nearest known name for a misspelt one):
///   unknown key or step, wrong type, value out of range
Recipe read_recipe(const TomlReader& segmentation, const std::string& frame = "LPS");

/// Reads a recipe file: the same `[segmentation]` table in a file of its own.
/// @throws InputError  as above, and for a file that cannot be read or is not TOML
Recipe read_recipe_file(const std::filesystem::path& file, const std::string& frame = "LPS");

/// The names of the recipes that come with the program.
std::vector<std::string> recipe_names();

/// Reads one of them. @throws InputError  for a name that is not among them, with the nearest one
Recipe read_shipped_recipe(const std::string& name, const std::string& frame = "LPS");

}  // namespace supine::segmentation
