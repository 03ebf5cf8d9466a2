// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "segmentation/doubt/doubt.h"
#include "segmentation/image.h"
#include "segmentation/steps/planes.h"
#include "segmentation/steps/recipe.h"

namespace supine::segmentation {

struct RecipeResult {
  LabelImage labels;
  std::vector<float> fraction_gland;  ///< share of gland per voxel, of the last step Gland; empty without one
  std::vector<std::string> log;       ///< one line per step: its number, what it is, what it did (voxels, ml, sigma)
  std::vector<CutPlane> planes;       ///< of the last step Planes
  std::vector<ChestWall> walls;       ///< of the steps Chest
  std::vector<Doubt> doubts;          ///< of a recipe that says which images it is for, and finds a chest
};

/// Runs the steps of a recipe on a grey volume.
/// @param progress  called before each step with a line that says which; may be empty
/// @param second  another series of the same visit, as its file has it, on any grid: for steps Gland with `second`
/// @throws InputError  a second series that no step looks at; an image of another kind than the recipe is for
/// (require_kind); naming the step (number and kind): a mask that no earlier step made, a seed outside the image or
///   outside its grey range (with the grey found there), a mask that comes out empty, what the steps themselves throw
RecipeResult run_recipe(GreyImage image, const Recipe& recipe,
                        const std::function<void(const std::string&)>& progress = {},
                        std::optional<GreyImage> second = {});

}  // namespace supine::segmentation
