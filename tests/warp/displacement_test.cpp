// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/displacement.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/segmentation/formats/image_files.h"
#include "tests/warp/two_shapes.h"

namespace supine::warp {
namespace {

using segmentation::testing::TemporaryFolder;

// Of an affine motion the way is linear, so a grid holds it but for its cells at the surface.
TEST(Displacement, LeadsFromTheTargetBackToTheSource) {
  const testing::MovedBox box = testing::moved_box(1, testing::affine);
  const Displacement field = displacement_of(box.shapes(), 1.5, 10);
  EXPECT_LT(field.error_rms_mm, 1e-5);
  const auto& grid = field.image.grid;
  for (const Eigen::Vector3d& from : std::vector<Eigen::Vector3d>{{20, 20, 20}, {5, 30, 12}, {35, 8, 33}}) {
    const Eigen::Vector3d there = testing::affine(from);
    const Eigen::Vector3i at = grid.continuous_index(there).array().round().cast<int>();
    const Eigen::Vector3d voxel = grid.point(at.cast<double>());
    const Eigen::Vector3d found = voxel + field.image.vectors[grid.index(at.x(), at.y(), at.z())].cast<double>();
    EXPECT_LT((found - testing::affine_back(voxel)).norm(), 1e-4);
  }
}

TEST(Displacement, EndsAtZeroAndHoldsBothShapes) {
  const testing::MovedBox box = testing::moved_box(2, testing::bent);
  const Displacement field = displacement_of(box.shapes(), 3, 10);
  const auto& grid = field.image.grid;
  for (int j = 0; j < grid.size.y(); ++j)
    for (int i = 0; i < grid.size.x(); ++i) EXPECT_EQ(field.image.vectors[grid.index(i, j, 0)].norm(), 0);
  for (const Points* shape : {&box.mesh.points, &box.target})
    for (Eigen::Index p = 0; p < shape->rows(); ++p) {
      const Eigen::Vector3d index = grid.continuous_index(shape->row(p).transpose());
      EXPECT_GT(index.minCoeff(), 5);
      EXPECT_GT((grid.size.cast<double>() - index).minCoeff(), 5);
    }
}

TEST(Displacement, AFinerGridIsNearerToTheModel) {
  const testing::MovedBox box = testing::moved_box(2, testing::bent);
  const double coarse = displacement_of(box.shapes(), 6, 10).error_rms_mm;
  const double fine = displacement_of(box.shapes(), 2, 10).error_rms_mm;
  EXPECT_LT(fine, 0.25 * coarse);
  EXPECT_LT(fine, 0.02);
}

TEST(Displacement, TransformFileSaysItsSenseAndHoldsEveryVector) {
  const TemporaryFolder folder;
  const testing::MovedBox box = testing::moved_box(1, testing::affine);
  const Displacement field = displacement_of(box.shapes(), 8, 10);
  write_tfm(field.image, folder / "a.tfm");
  std::ifstream stream(folder / "a.tfm");
  std::string line, comments, kind, fixed;
  std::vector<double> values;
  while (std::getline(stream, line)) {
    if (line[0] == '#') comments += line;
    if (line.rfind("Transform:", 0) == 0) kind = line.substr(11);
    if (line.rfind("FixedParameters:", 0) == 0) fixed = line.substr(17);
    if (line.rfind("Parameters:", 0) != 0) continue;
    std::istringstream numbers(line.substr(12));
    for (double v; numbers >> v;) values.push_back(v);
  }
  EXPECT_EQ(kind, "DisplacementFieldTransform_double_3_3");
  EXPECT_NE(comments.find("target shape to the place it comes from"), std::string::npos);
  ASSERT_EQ(values.size(), 3 * field.image.vectors.size());
  for (std::size_t n = 0; n < field.image.vectors.size(); ++n)
    for (int a = 0; a < 3; ++a) ASSERT_NEAR(values[3 * n + a], field.image.vectors[n][a], 6e-5);
  std::istringstream numbers(fixed);
  std::vector<double> sizes;
  for (double v; numbers >> v;) sizes.push_back(v);
  EXPECT_EQ(sizes.size(), 18u);
}

}  // namespace
}  // namespace supine::warp
