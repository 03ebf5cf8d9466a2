// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/elements/curved_cell.h"

#include <Eigen/LU>
#include <algorithm>
#include <functional>

#include "meshing/topology.h"

namespace supine::simulation {
namespace {

constexpr double inside_tolerance = 1e-9;  // of barycentric coordinates
constexpr int max_newton = 30, max_descent = 200;
constexpr double settled = 1e-13;  // a change of barycentric coordinates that is rounding

/// Closest barycentric coordinates without a negative one.
Eigen::Vector4d onto_simplex(const Eigen::Vector4d& b) {
  Eigen::Vector4d sorted = b;
  std::sort(sorted.data(), sorted.data() + 4, std::greater<>());
  double sum = 0, shift = 0;
  for (int i = 0; i < 4; ++i) {
    sum += sorted[i];
    if (sorted[i] > (sum - 1) / (i + 1)) shift = (sum - 1) / (i + 1);
  }
  return (b.array() - shift).max(0.0);
}

/// ∂N/∂ξ is linear in b: the corners' values, mixed.
Eigen::Matrix<double, 10, 3> tet10_gradient(const Eigen::Vector4d& b) {
  Eigen::Matrix<double, 10, 3> gradient = Eigen::Matrix<double, 10, 3>::Zero();
  for (int a = 0; a < 4; ++a) gradient += b[a] * tet10_corner_gradients()[a];
  return gradient;
}

void move(Eigen::Vector4d& b, const Eigen::Vector3d& step) {
  b[0] -= step.sum();
  b.tail<3>() += step;
}

}  // namespace

Eigen::Matrix3d CurvedCell::jacobian(const Eigen::Vector4d& b) const { return nodes_.transpose() * tet10_gradient(b); }

std::optional<Eigen::Vector4d> CurvedCell::inside(const Eigen::Vector3d& point, const Eigen::Vector4d& start) const {
  Eigen::Vector4d b = onto_simplex(start);
  for (int iteration = 0; iteration < max_newton; ++iteration) {
    const Eigen::Vector3d step = jacobian(b).fullPivLu().solve(point - at(b));
    if (!step.allFinite()) return std::nullopt;
    const double size = step.cwiseAbs().maxCoeff(), share = std::min(1.0, 0.5 / size);
    move(b, share * step);
    if (size > settled) continue;
    if (b.minCoeff() >= -inside_tolerance) return b;
    return std::nullopt;
  }
  return std::nullopt;
}

double CurvedCell::least_distance_mm(const Eigen::Vector3d& point) const {
  NodeRows<10> control = nodes_;
  for (int e = 0; e < 6; ++e) {
    const auto [a, b] = meshing::tet_edges[e];
    control.row(4 + e) = 2 * nodes_.row(4 + e) - 0.5 * (nodes_.row(a) + nodes_.row(b));
  }
  const Eigen::Array3d below = control.colwise().minCoeff().transpose().array() - point.array();
  const Eigen::Array3d above = point.array() - control.colwise().maxCoeff().transpose().array();
  return below.max(above).max(0.0).matrix().norm();
}

CurvedPlace CurvedCell::find(const Eigen::Vector3d& point, const Eigen::Vector4d& start) const {
  if (const auto b = inside(point, start)) return {*b, 0};
  return closest(point, start);
}

Eigen::Matrix<double, 10, 1> CurvedCell::weights(const Eigen::Vector3d& point, const Eigen::Vector4d& b) const {
  const Eigen::Vector3d rest = jacobian(b).fullPivLu().solve(point - at(b));
  return tet10_shape(b) + tet10_gradient(b) * rest;
}

/// By projected descent.
CurvedPlace CurvedCell::closest(const Eigen::Vector3d& point, const Eigen::Vector4d& start) const {
  CurvedPlace place{onto_simplex(start)};
  double distance = (point - at(place.b)).norm();
  double rate = 1 / jacobian(place.b).squaredNorm();
  for (int iteration = 0; iteration < max_descent; ++iteration) {
    const Eigen::Vector3d step = rate * jacobian(place.b).transpose() * (point - at(place.b));
    Eigen::Vector4d next = place.b;
    move(next, step);
    next = onto_simplex(next);
    const double further = (point - at(next)).norm();
    if (further > distance) {
      rate *= 0.5;
      continue;
    }
    const bool done = (next - place.b).cwiseAbs().maxCoeff() < 1e-10;
    place.b = next;
    distance = further;
    if (done) break;
  }
  place.outside_mm = distance;
  return place;
}

}  // namespace supine::simulation
