// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace supine::simulation {

/// Two triangles on a common edge, as the ways from the edge's first node: to its second, to the third node of the
/// triangle that runs along the edge, and to that of the one that runs against it; mm.
template <class T>
struct Hinge {
  using Way = Eigen::Matrix<T, 3, 1>;
  Way edge, first, second;

  /// Twice the triangles' areas times their normals.
  Way first_normal() const { return edge.cross(first); }
  Way second_normal() const { return second.cross(edge); }
};

/// 2 tan(θ/2) of the angle θ between the normals; 0 where flat, without bound where folded flat.
template <class T>
T bend(const Hinge<T>& h) {
  const auto n = h.first_normal(), m = h.second_normal();
  return 2.0 * n.cross(m).dot(h.edge) / (h.edge.norm() * (n.norm() * m.norm() + n.dot(m)));
}

/// ∂bend/∂(node), 1/mm, one row per node: edge, first, second triangle. ∂θ/∂(third node) is −|edge| n/|n|² with n the
/// triangle's first_normal() or second_normal(); the edge's nodes balance force and moment (Bridson et al. 2003).
template <class T>
Eigen::Matrix<T, 4, 3> bend_gradient(const Hinge<T>& h) {
  const auto n = h.first_normal(), m = h.second_normal();
  const T length2 = h.edge.squaredNorm(), b = bend(h), slope = -(1.0 + 0.25 * b * b) * h.edge.norm();
  const T at_first = h.first.dot(h.edge) / length2, at_second = h.second.dot(h.edge) / length2;
  Eigen::Matrix<T, 4, 3> gradient;
  gradient.row(2) = (slope / n.squaredNorm() * n).transpose();
  gradient.row(3) = (slope / m.squaredNorm() * m).transpose();
  gradient.row(1) = -at_first * gradient.row(2) - at_second * gradient.row(3);
  gradient.row(0) = -gradient.row(1) - gradient.row(2) - gradient.row(3);
  return gradient;
}

/// The nine coordinates of a hinge's ways as variables.
using HingeJet = ceres::Jet<double, 9>;

inline Hinge<HingeJet> with_derivatives(const Hinge<double>& h) {
  Hinge<HingeJet> result;
  for (int i = 0; i < 3; ++i) {
    result.edge[i] = HingeJet(h.edge[i], i);
    result.first[i] = HingeJet(h.first[i], 3 + i);
    result.second[i] = HingeJet(h.second[i], 6 + i);
  }
  return result;
}

/// Derivative by the nodes' twelve coordinates from that by the ways.
inline Eigen::Matrix<double, 12, 1> by_nodes(const HingeJet& value) {
  Eigen::Matrix<double, 12, 1> derivative;
  derivative.tail<9>() = value.v;
  derivative.head<3>() = -value.v.head<3>() - value.v.segment<3>(3) - value.v.tail<3>();
  return derivative;
}

}  // namespace supine::simulation
