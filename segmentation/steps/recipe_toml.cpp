// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/recipe_toml.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/suggestion.h"
#include "segmentation/formats/image_formats.h"
#include "segmentation/recipes/shipped.h"
#include "segmentation/steps/step_readers.h"

namespace supine::segmentation {
namespace {

Step read_step(const StepTable& table) {
  const std::string name = table.required_text("do");
  const auto found = std::find(std::begin(step_names), std::end(step_names), name);
  if (found == std::end(step_names))
    table.fail("do", "unknown step; " + suggestion(name, {std::begin(step_names), std::end(step_names)}));
  const Step step = step_readers[found - std::begin(step_names)](table);
  table.allow_no_more();
  return step;
}

}  // namespace

Recipe read_recipe(const TomlReader& segmentation, const std::string& frame) {
  const auto to_lps = formats::signs_to_lps(frame);
  if (!to_lps) segmentation.fail("case.frame", fmt::format("\"{}\" is not known; LPS or RAS expected", frame));
  segmentation.allow({"step", "recipe", "image"});
  if (const auto name = segmentation.text("recipe")) {
    if (segmentation.has("step"))
      segmentation.fail("recipe", "has no place beside [[segmentation.step]]; give a name, or steps");
    if (!shipped_recipe(*name))
      segmentation.fail("recipe", fmt::format("\"{}\" is not known; {}", *name, suggestion(*name, recipe_names())));
    return read_shipped_recipe(*name, frame);
  }
  segmentation.require("step");
  const toml::array* steps = segmentation.table().get_as<toml::array>("step");
  if (!steps || !steps->is_array_of_tables())
    segmentation.fail("step", "must be tables: write [[segmentation.step]], with two brackets, on a line of its own");
  Recipe recipe;
  recipe.fat_suppressed = segmentation.choice<bool>("image", {{"t1", false}, {"fatsat", true}});
  for (const toml::node& step : *steps) {
    const std::string place = fmt::format("{}.step {}", segmentation.section(), recipe.steps.size() + 1);
    recipe.steps.push_back(read_step({TomlReader(*step.as_table(), segmentation.file(), place), *to_lps}));
  }
  return recipe;
}

std::vector<std::string> recipe_names() {
  std::vector<std::string> names;
  for (const ShippedRecipe& recipe : shipped_recipes()) names.emplace_back(recipe.name);
  return names;
}

Recipe read_shipped_recipe(const std::string& name, const std::string& frame) {
  const ShippedRecipe* shipped = shipped_recipe(name);
  if (!shipped)
    throw InputError(
        fmt::format("no recipe \"{}\" comes with the program; {}", name, suggestion(name, recipe_names())));
  const toml::table table = toml::parse(shipped->text);
  Recipe recipe = read_recipe(*TomlReader(table, name + " (shipped)", "").sub_table("segmentation"), frame);
  recipe.name = name;
  return recipe;
}

Recipe read_recipe_file(const std::filesystem::path& file, const std::string& frame) {
  const toml::table table = parse_toml(file);
  const TomlReader reader(table, file, "");
  reader.allow({"segmentation"});
  const auto segmentation = reader.sub_table("segmentation");
  if (!segmentation) reader.fail("segmentation", "table [segmentation] is missing: it holds the steps of the recipe");
  return read_recipe(*segmentation, frame);
}

}  // namespace supine::segmentation
