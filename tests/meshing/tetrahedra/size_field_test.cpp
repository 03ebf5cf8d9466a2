// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/size_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/error.h"
#include "meshing/quality.h"
#include "meshing/tetrahedra/grade.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "meshing/topology.h"
#include "reconstruction/surface_check.h"
#include "tests/support/shapes.h"

namespace supine::meshing {
namespace {

// A box of 40 mm whose points move along z by a function of x.
PoseMesh box_moved_by(const std::function<double(double)>& along_z) {
  PoseMesh pose;
  pose.mesh = testing::box_mesh(8, 8, 8, {40, 40, 40});
  pose.positions = pose.mesh.points;
  for (Eigen::Index p = 0; p < pose.positions.rows(); ++p) pose.positions(p, 2) += along_z(pose.mesh.points(p, 0));
  return pose;
}

double kink(double x) { return x > 20 ? 0.3 * (x - 20) : 0; }

double mean_edge_near(const TetMesh& mesh, double x) {
  double sum = 0, count = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    double centre = 0;
    for (int k = 0; k < 4; ++k) centre += mesh.points(mesh.cells(c, k), 0) / 4;
    if (std::abs(centre - x) > 4) continue;
    sum += std::cbrt(6 * std::sqrt(2.0) * cell_volume_mm3(mesh.points, mesh.cells, c));
    count += 1;
  }
  return sum / count;
}

TEST(SizeField, IsLinearBetweenNodesAndConstantOutside) {
  SizeField field{{1, 2, 3}, 2, {3, 2, 2}, Eigen::VectorXd(12)};
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 3; ++x) field.size_mm[field.node(x, y, z)] = 1 + x + 10 * y + 100 * z;
  EXPECT_NEAR(field.at({1, 2, 3}), 1, 1e-12);
  EXPECT_NEAR(field.at({4, 3, 4}), 1 + 1.5 + 5 + 50, 1e-12);
  EXPECT_NEAR(field.at({99, 99, 99}), 113, 1e-12);
  EXPECT_NEAR(field.at({-99, -99, -99}), 1, 1e-12);
}

TEST(SizeField, IsSmallWhereTheGradientJumps) {
  const SizeField field = sizes_from_pose(box_moved_by(kink), 6000);
  EXPECT_LT(field.at({20, 20, 20}), 0.6 * field.at({6, 20, 20}));
  EXPECT_LT(field.at({20, 20, 20}), 0.6 * field.at({34, 20, 20}));
}

TEST(SizeField, RigidMotionsAndScaleDoNotMatter) {
  const PoseMesh pose = box_moved_by(kink);
  const SizeField a = sizes_from_pose(pose, 6000);
  PoseMesh far = pose;
  far.mesh.points = 10 * pose.mesh.points;
  far.positions = 10 * pose.positions;
  far.positions.rowwise() += Eigen::RowVector3d(500, 0, 0);
  const SizeField b = sizes_from_pose(far, 6000);
  for (const double x : {5.0, 15.0, 20.0, 30.0}) EXPECT_NEAR(b.at({10 * x, 200, 200}), 10 * a.at({x, 20, 20}), 0.5);
}

TEST(SizeField, MesherFollowsItAndMeetsTheCount) {
  const SizeField field = sizes_from_pose(box_moved_by(kink), 8000);
  const reconstruction::Surface body = testing::boundary_surface(testing::box_mesh(5, 5, 5, {40, 40, 40}));
  const reconstruction::Surface surface = refine_to_sizes(body, field);
  EXPECT_GT(surface.triangles.rows(), body.triangles.rows());
  EXPECT_EQ(reconstruction::check_surface(surface).euler, 2);
  const TetMesh mesh = tetrahedralise(surface, Inside{{}, &field}, {.cells = 8000}).mesh;
  EXPECT_NEAR(static_cast<double>(mesh.cells.rows()) / 8000, 1, 0.25);
  EXPECT_LT(mean_edge_near(mesh, 20), 0.75 * mean_edge_near(mesh, 5));
  EXPECT_EQ(measure_quality(mesh).inverted, 0);
}

TEST(SizeField, RefusesTooFewCells) { EXPECT_THROW(sizes_from_pose(box_moved_by(kink), 3), InputError); }

}  // namespace
}  // namespace supine::meshing
