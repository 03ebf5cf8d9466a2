// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/shapes.h"

namespace supine {
namespace {

using Corners = Eigen::Matrix<double, 4, 3>;

Corners corners(std::initializer_list<double> values) {
  Corners x;
  std::copy(values.begin(), values.end(), x.reshaped<Eigen::RowMajor>().begin());
  return x;
}

TEST(Quality, RegularTetrahedron) {
  const Corners x = corners({1, 1, 1, -1, 1, -1, 1, -1, -1, -1, -1, 1});
  const auto [low, high] = meshing::dihedral_range_deg(x);
  const double regular = std::acos(1.0 / 3) * 180 / std::numbers::pi;
  EXPECT_NEAR(low, regular, 1e-10);
  EXPECT_NEAR(high, regular, 1e-10);
  EXPECT_NEAR(meshing::radius_ratio(x), 1, 1e-12);
}

TEST(Quality, CornerOfACube) {
  const Corners x = corners({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  const auto [low, high] = meshing::dihedral_range_deg(x);
  EXPECT_NEAR(low, std::acos(1 / std::sqrt(3.0)) * 180 / std::numbers::pi, 1e-10);
  EXPECT_NEAR(high, 90, 1e-10);
  const double inradius = 1 / (3 + std::sqrt(3.0)), circumradius = std::sqrt(3.0) / 2;
  EXPECT_NEAR(meshing::radius_ratio(x), 3 * inradius / circumradius, 1e-12);
}

TEST(Quality, InvertedAndFlatAreToldApartFromGood) {
  const Corners inverted = corners({0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1});
  EXPECT_EQ(meshing::dihedral_range_deg(inverted), std::make_pair(0.0, 180.0));
  EXPECT_LT(meshing::radius_ratio(inverted), 0);
  const Corners flat = corners({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  EXPECT_EQ(meshing::dihedral_range_deg(flat), std::make_pair(0.0, 180.0));
  EXPECT_NEAR(meshing::radius_ratio(flat), 0, 1e-12);
}

TEST(Quality, ReportCountsAnInvertedCellAndFindsIt) {
  meshing::TetMesh mesh = testing::box_mesh(2, 2, 2, {20, 20, 20});
  EXPECT_EQ(meshing::measure_quality(mesh).inverted, 0);
  std::swap(mesh.cells(17, 1), mesh.cells(17, 2));
  const auto report = meshing::measure_quality(mesh);
  EXPECT_EQ(report.inverted, 1);
  EXPECT_EQ(report.worst_cell, 17);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) centre += mesh.points.row(mesh.cells(17, k)).transpose() / 4;
  EXPECT_LT((report.worst_place_mm - centre).norm(), 1e-12);
}

TEST(Quality, TissueVolumesFollowTheFractions) {
  meshing::TetMesh mesh = testing::box_mesh(1, 1, 1, {10, 10, 10});
  mesh.fraction.col(1).setConstant(0.25);
  mesh.fraction.col(2).setConstant(0.75);
  const auto report = meshing::measure_quality(mesh);
  EXPECT_NEAR(report.tissue_ml[1], 0.25, 1e-12);
  EXPECT_NEAR(report.tissue_ml[2], 0.75, 1e-12);
  Eigen::Index cells = 0;
  for (const auto n : report.smallest_dihedral) cells += n;
  EXPECT_EQ(cells, 6);
}

}  // namespace
}  // namespace supine
