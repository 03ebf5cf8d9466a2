// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/tissue_fractions.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "common/error.h"
#include "meshing/quality.h"
#include "segmentation/tissue.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;

// Voxels of `spacing` mm fill [0, 20]³; gland where x < split, adipose elsewhere; air around.
LabelImage half_space(double spacing, double split) {
  LabelImage image;
  const int n = static_cast<int>(20 / spacing), margin = 4;
  image.grid.size.setConstant(n + 2 * margin);
  image.grid.spacing_mm.setConstant(spacing);
  image.grid.origin_mm.setConstant(spacing * (0.5 - margin));
  image.voxels.assign(image.grid.count(), 0);
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const bool gland = (i + 0.5) * spacing < split;
        image.at(i + margin, j + margin, k + margin) =
            static_cast<std::uint8_t>(gland ? Tissue::gland : Tissue::adipose);
      }
    }
  }
  return image;
}

constexpr int adipose = static_cast<int>(Tissue::adipose), gland = static_cast<int>(Tissue::gland);

TEST(TissueFractions, HalfSpaceIsExactAwayFromTheBorder) {
  auto mesh = testing::box_mesh(4, 2, 2, {20, 20, 20});  // the border runs along faces of the cells
  const auto report = meshing::assign_tissue(mesh, half_space(1, 10));
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    double x = 0;
    for (int k = 0; k < 4; ++k) x += mesh.points(mesh.cells(c, k), 0) / 4;
    EXPECT_EQ(mesh.tissue[c], x < 10 ? gland : adipose);
    EXPECT_EQ(mesh.fraction(c, mesh.tissue[c]), 1);
  }
  EXPECT_NEAR(report.voxel_ml[gland], 4, 1e-12);
  EXPECT_NEAR(report.voxel_ml[adipose], 4, 1e-12);
  EXPECT_EQ(report.outside_share, 0);
}

TEST(TissueFractions, AShareOfGlandCountsInsteadOfTheLabel) {
  auto mesh = testing::box_mesh(2, 2, 2, {20, 20, 20});
  const LabelImage labels = half_space(1, 10);
  const std::vector<float> share(labels.voxels.size(), 0.25f);
  const auto report = meshing::assign_tissue(mesh, labels, share);
  EXPECT_NEAR(report.voxel_ml[gland], 2, 1e-6);
  EXPECT_NEAR(report.voxel_ml[adipose], 6, 1e-6);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    EXPECT_NEAR(mesh.fraction(c, gland), 0.25, 1e-6);
    EXPECT_NEAR(mesh.fraction(c, adipose), 0.75, 1e-6);
    EXPECT_EQ(mesh.tissue[c], adipose);
  }
}

TEST(TissueFractions, VolumesMatchTheVoxelsWhenTheBorderCutsCells) {
  auto mesh = testing::box_mesh(3, 3, 3, {20, 20, 20});
  const auto report = meshing::assign_tissue(mesh, half_space(0.5, 8));
  const auto q = meshing::measure_quality(mesh);
  // A border along the cells' own edges is the worst case for points on a lattice.
  EXPECT_NEAR(q.tissue_ml[gland], report.voxel_ml[gland], 0.03 * report.voxel_ml[gland]);
  EXPECT_LT((mesh.fraction.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
}

TEST(TissueFractions, AirAtTheStaircaseCountsForTheNearestTissue) {
  auto mesh = testing::box_mesh(3, 3, 3, {20.8, 20.8, 20.8});  // reaches 0.8 mm into the air
  const auto report = meshing::assign_tissue(mesh, half_space(1, 10));
  EXPECT_EQ(report.outside_share, 0);
  EXPECT_EQ(mesh.fraction.col(0).cwiseAbs().maxCoeff(), 0);
}

TEST(TissueFractions, ObliqueGridsAreRead) {
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  auto mesh = testing::box_mesh(3, 3, 3, {20, 20, 20}), turned = testing::moved(mesh, rotation, {5, 6, 7});
  LabelImage image = half_space(1, 8);
  meshing::assign_tissue(mesh, image);
  image.grid.direction = rotation;
  image.grid.origin_mm = rotation * image.grid.origin_mm + Eigen::Vector3d(5, 6, 7);
  meshing::assign_tissue(turned, image);
  EXPECT_LT((mesh.fraction - turned.fraction).cwiseAbs().maxCoeff(),
            0.05);  // points on voxel borders may fall either way
}

TEST(TissueFractions, RefusesLabelsOfAnotherPlace) {
  auto mesh = testing::box_mesh(2, 2, 2, {20, 20, 20});
  LabelImage image = half_space(1, 10);
  image.grid.origin_mm.x() += 200;
  try {
    meshing::assign_tissue(mesh, image);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("100.0 %"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace supine
