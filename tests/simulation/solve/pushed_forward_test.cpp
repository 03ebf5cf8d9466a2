// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/pushed_forward.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "simulation/mechanics.h"
#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

/// A smooth change of shape of @p size mm.
Points wave(const Points& X, double size) {
  Points moved = X;
  for (Eigen::Index n = 0; n < X.rows(); ++n)
    moved.row(n) += size * Eigen::RowVector3d(std::sin(X(n, 1) / 9), std::sin(X(n, 2) / 7), std::cos(X(n, 0) / 8));
  return moved;
}

/// Stretched along z, kept in volume, sheared and turned.
Eigen::Matrix3d large_deformation() {
  Eigen::Matrix3d f = Eigen::Vector3d(1 / std::sqrt(1.6), 1 / std::sqrt(1.6), 1.6).asDiagonal();
  f(0, 2) += 0.3;
  return Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, -1).normalized()) * f;
}

TEST(PushedForward, IsTheDeformationItselfWhereThatIsTheSameEverywhere) {
  for (const int order : {1, 2}) {
    const meshing::TetMesh& mesh = supine::testing::dome_scene(order).mesh;
    const Eigen::Matrix3d f = large_deformation();
    const Eigen::RowVector3d shift(3, -2, 5);
    const Points x = (mesh.points * f.transpose()).rowwise() + shift, moved = wave(mesh.points, 2);
    const Points expected = (moved * f.transpose()).rowwise() + shift;
    EXPECT_LT((pushed_forward(mesh.cells, x, mesh.points, moved) - expected).cwiseAbs().maxCoeff(), 1e-10) << order;
  }
}

TEST(PushedForward, LeavesAShapeWhoseUndeformedOneDidNotMove) {
  const meshing::TetMesh& mesh = supine::testing::dome_scene(2).mesh;
  const Points x = wave(mesh.points, 1.5);  // no node stays where it was
  EXPECT_EQ((pushed_forward(mesh.cells, x, mesh.points, mesh.points) - x).cwiseAbs().maxCoeff(), 0);
}

TEST(PushedForward, ANodeThatDidNotMoveStaysOnItsUndeformedPlace) {
  const meshing::TetMesh& mesh = supine::testing::dome_scene(1).mesh;
  Points x = mesh.points * large_deformation().transpose();
  x.row(7) = mesh.points.row(7);
  const Points moved = wave(mesh.points, 2);
  EXPECT_LT((pushed_forward(mesh.cells, x, mesh.points, moved) - moved).row(7).norm(), 1e-12);
}

TEST(PushedForward, KeepsTheVolumeThatMovingByTheSameWayDoesNot) {
  const meshing::TetMesh& mesh = supine::testing::dome_scene(2).mesh;
  Points x = (mesh.points * large_deformation().transpose()).rowwise() + Eigen::RowVector3d(3, -2, 5);
  x.col(1) += x.col(0).cwiseAbs2() / 150;
  const Points moved = wave(mesh.points, 0.4);
  const Eigen::VectorXd before = cell_det_f_at_points(mesh.cells, x, mesh.points);
  const auto off = [&](const Points& shape) {
    return (cell_det_f_at_points(mesh.cells, shape, moved) - before).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(off(pushed_forward(mesh.cells, x, mesh.points, moved)), 0.3 * off(x + moved - mesh.points));
}

}  // namespace
}  // namespace supine::simulation
