// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/LU>

#include "simulation/elements/elements.h"

namespace supine::simulation {

/// Volume and shape gradients of a tetrahedron at one quadrature point.
template <class Element>
struct TetPoint {
  double det = 0;                              ///< det ∂X/∂ξ; <= 0 when the element is inverted
  double volume = 0;                           ///< det × quadrature weight, mm³
  Eigen::Matrix<double, Element::nodes, 3> b;  ///< ∂N_a/∂X_J, 1/mm; only when det > 0
};

/// At quadrature point @p p of the tetrahedron with these nodes (mm).
/// @tparam Element  Tet4 or Tet10   @pre  0 <= p < Element::points
template <class Element>
TetPoint<Element> tet_point(const NodeRows<Element::nodes>& nodes, int p) {
  const auto& table = Element::table();
  TetPoint<Element> point;
  const Eigen::Matrix3d jacobian = nodes.transpose() * table.gradient[p];
  point.det = jacobian.determinant();
  if (!(point.det > 0)) return point;
  point.volume = point.det * table.weight[p];
  point.b.noalias() = table.gradient[p] * jacobian.inverse();
  return point;
}

}  // namespace supine::simulation
