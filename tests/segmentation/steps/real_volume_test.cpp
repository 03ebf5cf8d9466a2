// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "segmentation/formats/image_io.h"
#include "segmentation/label_map.h"
#include "segmentation/steps/recipe_toml.h"
#include "segmentation/steps/run_recipe.h"

namespace supine::segmentation {
namespace {

namespace fs = std::filesystem;

fs::path shared_data() {
  const char* folder = std::getenv("SUPINE_SHARED_DATA");
  return folder ? folder : SUPINE_SHARED_DATA;
}

const std::map<int, Tissue> table = {{0, Tissue::air},    {1, Tissue::adipose}, {2, Tissue::gland},
                                     {3, Tissue::muscle}, {4, Tissue::skin},    {5, Tissue::excluded}};

struct T1Case {
  const char* name;
  double rim_radius_mm;  ///< where the dark line of the skin ends in the volume
};

class RealVolume : public ::testing::TestWithParam<T1Case> {};

TEST_P(RealVolume, RecipeFindsTheTissuesOfAGreyVolume) {
  const fs::path folder = shared_data() / "hidden-open" / GetParam().name;
  if (!fs::exists(folder / "mri.nrrd")) GTEST_SKIP() << folder << " is not there";
  Recipe recipe = read_recipe_file(fs::path(SUPINE_SOURCE_DIR) / "segmentation" / "recipes" / "t1_fat_bright.toml");
  for (Step& step : recipe.steps)
    if (auto* region = std::get_if<Region>(&step)) region->radius_mm = GetParam().rim_radius_mm;
  const LabelImage labels = run_recipe(read_image(folder / "mri.nrrd", "").image, recipe).labels;
  const LabelImage truth = map_labels(read_image(folder / "labels.nrrd", "").image, table, "labels.nrrd").image;
  const Dice overlap = dice(labels, truth);
  EXPECT_GT(overlap.breast, 0.98);
  for (const Tissue tissue : {Tissue::adipose, Tissue::gland, Tissue::skin, Tissue::muscle, Tissue::excluded})
    EXPECT_GT(overlap.tissue[static_cast<int>(tissue)], 0.97) << tissue_names[static_cast<int>(tissue)];
  EXPECT_EQ(count_components(labels).meshed, 1u);
  EXPECT_NO_THROW(check_tissues(labels, "mri.nrrd"));
  EXPECT_NO_THROW(check_edge(labels, "mri.nrrd"));
}

INSTANTIATE_TEST_SUITE_P(HiddenOpen, RealVolume, ::testing::Values(T1Case{"ligament-1", 82}, T1Case{"null-1", 76}),
                         [](const auto& which) { return which.index == 0 ? "ligament" : "null"; });

TEST(RealVolume, PhantomVolumesAreThoseOfTheirPages) {
  const fs::path file = shared_data() / "phantoms" / "breastphantom_scattered_1mm.nrrd";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not there";
  const std::map<int, Tissue> values = {{0, Tissue::air},       {1, Tissue::adipose}, {2, Tissue::skin},
                                        {29, Tissue::gland},    {33, Tissue::nipple}, {40, Tissue::muscle},
                                        {88, Tissue::ligament}, {95, Tissue::gland},  {125, Tissue::gland},
                                        {150, Tissue::vessel},  {225, Tissue::vessel}};
  const auto mapped = map_labels(read_image(file, "LPS").image, values, file.string());
  const auto counts = count_tissues(mapped.image);
  const double body_ml =
      static_cast<double>(mapped.image.voxels.size() - counts[0]) * mapped.image.grid.voxel_volume_mm3() / 1000;
  EXPECT_NEAR(body_ml, 505, 10);
}

}  // namespace
}  // namespace supine::segmentation
