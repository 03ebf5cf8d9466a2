// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/embedding.h"

#include <gtest/gtest.h>

#include "simulation/elements/curved_cell.h"
#include "tests/simulation/scene.h"
#include "tests/support/shapes.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

constexpr double size_mm = 40;

/// A map that quadratic cells hold exactly: nodes of a box moved by it give cells that are it.
Points bent(const Points& u) {
  Points x = u;
  for (Eigen::Index p = 0; p < u.rows(); ++p) {
    const double a = u(p, 0) / size_mm, b = u(p, 1) / size_mm, c = u(p, 2) / size_mm;
    x.row(p) += Eigen::RowVector3d(6 * b * c - 4 * c * c, 5 * a * a - 3 * a * b, 9 * a * (1 - a) + 7 * b * b);
  }
  return x;
}

/// Points of the box, margin_mm from its sides (outside for negative ones).
Points points_of_box(int count, double margin_mm) {
  const Points random = testing::random_matrix(count, 3, 5);
  return (random.array() * (0.5 * size_mm - margin_mm) + 0.5 * size_mm).matrix();
}

class EmbeddingTest : public ::testing::TestWithParam<int> {
 protected:
  EmbeddingTest() : mesh(testing::box_mesh(3, 3, 3, {size_mm, size_mm, size_mm})) {
    if (GetParam() == 2) mesh = testing::quadratic(mesh);
    straight = mesh.points;
  }
  meshing::TetMesh mesh;
  Points straight;
};

TEST_P(EmbeddingTest, PointsFollowAnAffineMotionInsideAndOutside) {
  const Points points = points_of_box(300, -2);
  Eigen::Matrix3d turn = testing::random_matrix(3, 3, 8);
  const Eigen::RowVector3d shift(3, -7, 11);
  const Points moved = Embedding(mesh, points).at((straight * turn).rowwise() + shift);
  const Points expected = (points * turn).rowwise() + shift;
  EXPECT_LT((moved - expected).cwiseAbs().maxCoeff(), 1e-10);
}

TEST_P(EmbeddingTest, SaysHowFarOutsideAPointLies) {
  Points points(3, 3);
  points << 20, 20, 20, 20, 20, size_mm + 1.5, -3, size_mm + 4, 20;
  const Eigen::VectorXd outside = Embedding(mesh, points).outside_mm();
  EXPECT_NEAR(outside[0], 0, 1e-9);
  EXPECT_NEAR(outside[1], 1.5, 1e-6);
  EXPECT_NEAR(outside[2], 5, 1e-6);
}

// A cell that is passed over because of its least distance would have been no nearer.
TEST(CurvedCell, IsNoNearerThanItsLeastDistance) {
  meshing::TetMesh mesh = testing::quadratic(testing::box_mesh(2, 2, 2, {size_mm, size_mm, size_mm}));
  mesh.points = bent(mesh.points);
  const Points points = points_of_box(20, -0.4 * size_mm);
  double nearest_share = 0;
  for (int c = 0; c < mesh.cells.rows(); ++c)
    for (Eigen::Index p = 0; p < points.rows(); ++p) {
      const CurvedCell cell(mesh.points, mesh.cells, c);
      const Eigen::Vector3d point = points.row(p).transpose();
      const double least = cell.least_distance_mm(point);
      const double found = cell.find(point, Eigen::Vector4d::Constant(0.25)).outside_mm;
      EXPECT_LE(least, found + 1e-9) << "cell " << c << ", point " << p;
      if (found > 5) nearest_share = std::max(nearest_share, least / found);
    }
  EXPECT_GT(nearest_share, 0.95) << "as far as the box where that is the cell's own side";
}

INSTANTIATE_TEST_SUITE_P(Orders, EmbeddingTest, ::testing::Values(1, 2));

// The curved cells hold the map exactly, so a point bent with the box is found where it came from. Straight-cell
// barycentrics would be off by what the edges bend: millimetres here.
TEST(EmbeddingCurved, FindsPointsOfAKnownCurvedMapExactly) {
  meshing::TetMesh mesh = testing::quadratic(testing::box_mesh(3, 3, 3, {size_mm, size_mm, size_mm}));
  const Points straight = mesh.points;
  mesh.points = bent(straight);
  const Points places = points_of_box(400, 0);
  const Embedding embedding(mesh, bent(places));
  EXPECT_LT(embedding.outside_mm().maxCoeff(), 1e-9);
  EXPECT_LT((embedding.at(straight) - places).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((embedding.at(mesh.points) - bent(places)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(EmbeddingCurved, APointOutsideStaysWhereItIsWhenNothingMoves) {
  meshing::TetMesh mesh = testing::quadratic(testing::box_mesh(2, 2, 2, {size_mm, size_mm, size_mm}));
  mesh.points = bent(mesh.points);
  const Points points = bent(points_of_box(200, -3));
  const Embedding embedding(mesh, points);
  EXPECT_GT(embedding.outside_mm().maxCoeff(), 1);
  EXPECT_LT((embedding.at(mesh.points) - points).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace supine::simulation
