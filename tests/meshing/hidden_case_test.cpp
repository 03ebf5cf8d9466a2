// SPDX-License-Identifier: AGPL-3.0-or-later
// The anatomy of imaged breasts whose geometry is known (skipped where the shared data are not there).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "meshing/anatomy.h"
#include "reconstruction/reconstruct.h"
#include "segmentation/formats/image_io.h"
#include "segmentation/label_map.h"

namespace supine {
namespace {

using segmentation::Tissue;

meshing::TetMesh surface_only(const reconstruction::Reconstruction& shape) {
  meshing::TetMesh mesh;  // the anatomy needs boundary and muscle; cells only tell where nipple tissue is
  mesh.points = shape.breast.surface.points;
  mesh.faces = shape.breast.surface.triangles;
  mesh.region = shape.breast.surface.region;
  mesh.cells.resize(0, 4);
  mesh.fraction.resize(0, segmentation::tissue_count);
  mesh.muscle = shape.muscle;
  return mesh;
}

class HiddenCase : public ::testing::TestWithParam<std::string> {};

TEST_P(HiddenCase, FootAndRimAreThoseOfTheBodyImaged) {
  const std::filesystem::path folder = std::filesystem::path(SUPINE_SHARED_DATA) / "hidden-open";
  if (!std::filesystem::exists(folder / GetParam())) GTEST_SKIP() << folder / GetParam() << " is not there";
  const auto file = segmentation::read_image(folder / GetParam() / "labels.nrrd", "LPS");
  const std::map<int, Tissue> labels = {{0, Tissue::air},    {1, Tissue::adipose}, {2, Tissue::gland},
                                        {3, Tissue::muscle}, {4, Tissue::skin},    {5, Tissue::excluded}};
  const auto mapped = segmentation::map_labels(file.image, labels, "labels.nrrd");
  reconstruction::ReconstructOptions options;
  options.cut.excluded = true;
  const auto mesh = surface_only(reconstruction::reconstruct(mapped.image, options));
  const auto anatomy = meshing::compute_anatomy(mesh, "left");
  std::ifstream in(folder / "answers" / (GetParam() + ".json"));
  const auto truth = nlohmann::json::parse(in)["geometry"];
  const double foot = truth["a"], rim = truth["hrim"], muscle_radius = truth["R"];
  RecordProperty("foot_radius_mm", fmt::format("{:.2f} (true {:.2f})", anatomy.foot_radius_mm, foot));
  EXPECT_NEAR(anatomy.foot_radius_mm, foot, 0.05 * foot);
  // The rim's thickness is imaged under gravity, and along the muscle's normal instead of along the axis.
  EXPECT_NEAR(anatomy.rim_thickness_mm, rim, 0.15 * rim);
  EXPECT_LT(anatomy.foot_centre_mm.norm(), 5);  // the dome's axis meets the muscle in the origin
  EXPECT_LT((anatomy.outward - Eigen::Vector3d(0, -1, 0)).norm(), 0.05);
  // The smoothed zero level keeps to the cylinder the labels were made from. Where it runs along the voxels' layers,
  // a terrace 30 mm wide may stand off by half a voxel: too wide for any smoothing that keeps the chest's shape.
  double worst = 0, squares = 0;
  int count = 0;
  for (double angle = -0.4; angle <= 0.4; angle += 0.05) {
    for (double z = -50; z <= 50; z += 10) {
      const Eigen::Vector3d on(muscle_radius * std::sin(angle), muscle_radius * (1 - std::cos(angle)), z);
      const double value = anatomy.muscle->value(on);
      worst = std::max(worst, std::abs(value));
      squares += value * value;
      ++count;
    }
  }
  RecordProperty("muscle_mm", fmt::format("{:.3f} rms, {:.3f} at most", std::sqrt(squares / count), worst));
  EXPECT_LT(std::sqrt(squares / count), 0.2);
  EXPECT_LT(worst, 0.6);
}

INSTANTIATE_TEST_SUITE_P(Open, HiddenCase,
                         ::testing::Values("adhesion-1", "gland_stiffness-1", "gravity_tilt-1", "ligament-1",
                                           "misregistration-1", "null-1", "null-2", "strain_stiffening-1"),
                         [](const auto& parameter) {
                           std::string name = parameter.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace supine
