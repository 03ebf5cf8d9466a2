// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/curvature.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "meshing/quads/field_graph.h"

namespace supine::meshing {
namespace {

constexpr int smoothing_rounds = 4;
constexpr double sure_turn = 0.5;  // (k1 − k2) × size, rad, from which a wish counts fully
constexpr double least_turn = 0.08;

// Shape operators as symmetric 3×3 matrices that vanish along the normal.
std::vector<Eigen::Matrix3d> shape_operators(const FieldGraph& graph) {
  std::vector<Eigen::Matrix3d> result(graph.size(), Eigen::Matrix3d::Zero());
#pragma omp parallel for schedule(static)
  for (int p = 0; p < graph.size(); ++p) {
    const Eigen::Vector3d n = graph.normals.row(p).transpose(), at = graph.points.row(p).transpose();
    const Eigen::Vector3d u = n.unitOrthogonal(), v = n.cross(u);
    Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (int i = graph.start[p]; i < graph.start[p + 1]; ++i) {
      const int q = graph.neighbour[i];
      const Eigen::Vector3d dx = graph.points.row(q).transpose() - at, dn = graph.normals.row(q).transpose() - n;
      const double x = dx.dot(u), y = dx.dot(v);
      const Eigen::Vector3d first(x, y, 0), second(0, x, y);  // rows of [a b; b c] (x, y)
      normal_matrix += first * first.transpose() + second * second.transpose();
      right += first * dn.dot(u) + second * dn.dot(v);
    }
    const double scale = normal_matrix.trace();
    if (scale <= 0) continue;
    normal_matrix.diagonal().array() += 1e-6 * scale;
    const Eigen::Vector3d abc = normal_matrix.ldlt().solve(right);
    Eigen::Matrix<double, 3, 2> frame;
    frame << u, v;
    Eigen::Matrix2d shape;
    shape << abc[0], abc[1], abc[1], abc[2];
    result[p] = frame * shape * frame.transpose();
  }
  return result;
}

void smooth(const FieldGraph& graph, std::vector<Eigen::Matrix3d>& shapes) {
  std::vector<Eigen::Matrix3d> next(shapes.size());
  for (int round = 0; round < smoothing_rounds; ++round) {
#pragma omp parallel for schedule(static)
    for (int p = 0; p < graph.size(); ++p) {
      double weight = 1;
      Eigen::Matrix3d sum = shapes[p];
      for (int i = graph.start[p]; i < graph.start[p + 1]; ++i) {
        sum += shapes[graph.neighbour[i]];
        weight += 1;
      }
      const Eigen::Vector3d n = graph.normals.row(p).transpose();
      const Eigen::Matrix3d flat = Eigen::Matrix3d::Identity() - n * n.transpose();
      next[p] = flat * sum * flat / weight;
    }
    shapes.swap(next);
  }
}

std::vector<Eigen::Matrix3d> smooth_shapes(const FieldGraph& graph) {
  std::vector<Eigen::Matrix3d> shapes = shape_operators(graph);
  smooth(graph, shapes);
  return shapes;
}

}  // namespace

Points curvature_wishes(const FieldGraph& graph) {
  const std::vector<Eigen::Matrix3d> shapes = smooth_shapes(graph);
  Points wishes = Points::Zero(graph.size(), 3);
#pragma omp parallel for schedule(static)
  for (int p = 0; p < graph.size(); ++p) {
    const Eigen::Vector3d n = graph.normals.row(p).transpose(), u = n.unitOrthogonal(), v = n.cross(u);
    const double a = u.dot(shapes[p] * u), b = u.dot(shapes[p] * v), c = v.dot(shapes[p] * v);
    const double turn = std::hypot(a - c, 2 * b) * graph.size_mm(p);  // k1 − k2 over one edge
    const double sure = std::clamp((turn - least_turn) / (sure_turn - least_turn), 0.0, 1.0);
    const double angle = 0.5 * std::atan2(2 * b, a - c);
    wishes.row(p) = sure * (std::cos(angle) * u + std::sin(angle) * v).transpose();
  }
  return wishes;
}

Eigen::VectorXd largest_curvatures(const FieldGraph& graph) {
  const std::vector<Eigen::Matrix3d> shapes = smooth_shapes(graph);
  Eigen::VectorXd result(graph.size());
  for (int p = 0; p < graph.size(); ++p)
    result(p) = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(shapes[p], Eigen::EigenvaluesOnly)
                    .eigenvalues()
                    .cwiseAbs()
                    .maxCoeff();
  return result;
}

}  // namespace supine::meshing
