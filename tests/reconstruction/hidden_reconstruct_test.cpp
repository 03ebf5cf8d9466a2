// SPDX-License-Identifier: AGPL-3.0-or-later
// Surfaces of the shared label volumes (skipped where those are not there).
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "meshing/decimate/decimate.h"
#include "reconstruction/reconstruct.h"
#include "segmentation/formats/image_io.h"
#include "segmentation/label_map.h"

namespace supine::reconstruction {
namespace {

using segmentation::Tissue;

struct Volume {
  std::string file;
  bool phantom;
};

const std::map<int, Tissue> case_labels = {{0, Tissue::air},    {1, Tissue::adipose}, {2, Tissue::gland},
                                           {3, Tissue::muscle}, {4, Tissue::skin},    {5, Tissue::excluded}};
const std::map<int, Tissue> phantom_labels = {
    {0, Tissue::air},     {1, Tissue::adipose}, {2, Tissue::skin},    {29, Tissue::gland},   {33, Tissue::nipple},
    {40, Tissue::muscle}, {95, Tissue::gland},  {125, Tissue::gland}, {150, Tissue::vessel}, {225, Tissue::vessel}};

class SharedVolume : public ::testing::TestWithParam<Volume> {};

TEST_P(SharedVolume, BecomesASoundSurfaceWithItsRegions) {
  const std::filesystem::path file = std::filesystem::path(SUPINE_SHARED_DATA) / GetParam().file;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const bool phantom = GetParam().phantom;
  const auto read = segmentation::read_image(file, "LPS");
  const auto labels = segmentation::map_labels(read.image, phantom ? phantom_labels : case_labels, file.string());
  ReconstructOptions options;
  options.cut.excluded = !phantom;
  options.cut.edge = options.cut.rim = phantom;
  const Reconstruction shape = reconstruct(labels.image, options);
  const SurfaceReport& report = shape.breast.report;
  EXPECT_TRUE(report.closed() && report.manifold());
  EXPECT_EQ(report.genus(), 0);
  EXPECT_EQ(report.components, shape.breast.voxel_components);
  EXPECT_LT(std::abs(shape.breast.volume_error()), 0.003);
  EXPECT_TRUE(self_intersections(shape.breast.surface).empty());
  for (const Region region : {Region::inner, Region::skin, Region::cut})
    EXPECT_GT(report.region_area_mm2[static_cast<int>(region)], 200) << region_names[static_cast<int>(region)];

  const meshing::DecimateResult coarse = meshing::decimate(shape.breast.surface, {});
  EXPECT_TRUE(coarse.reached_target) << coarse.reason;
  EXPECT_LE(coarse.distance_mm, 1.0);
  EXPECT_LT(std::abs(coarse.volume_change), 0.005);
}

INSTANTIATE_TEST_SUITE_P(All, SharedVolume,
                         ::testing::Values(Volume{"hidden-open/null-1/labels.nrrd", false},
                                           Volume{"hidden-open/strain_stiffening-1/labels.nrrd", false},
                                           Volume{"phantoms/victre_p_1_1mm.nrrd", true}),
                         [](const auto& volume) {
                           std::string name = volume.param.file;
                           for (char& c : name)
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           return name;
                         });

}  // namespace
}  // namespace supine::reconstruction
