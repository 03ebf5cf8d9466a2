// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "common/arrays.h"

namespace supine::simulation {

/// Shape functions of one element tabulated at its quadrature points.
/// @tparam N  nodes   @tparam D  parent dimension   @tparam Q  quadrature points
template <int N, int D, int Q>
struct ShapeTable {
  // Nodes: corners, then mid-edges in VTK's order. ξ: the barycentric coordinates but the first.
  std::array<Eigen::Matrix<double, N, 1>, Q> value;     ///< N_a
  std::array<Eigen::Matrix<double, N, D>, Q> gradient;  ///< ∂N_a/∂ξ
  std::array<double, Q> weight;                         ///< parent measure; sums to 1/6 (tetrahedra) or 1/2 (triangles)
};

/// Linear tetrahedron, one point (exact for its constant strain).
struct Tet4 {
  static constexpr int nodes = 4, points = 1;
  static const ShapeTable<4, 3, 1>& table();
};

/// Quadratic tetrahedron, VTK node order, four points (degree 2; Zienkiewicz and Taylor, The Finite Element Method,
/// table 5.3).
struct Tet10 {
  static constexpr int nodes = 10, points = 4;
  static const ShapeTable<10, 3, 4>& table();
};

/// Linear triangle, three points (degree 2: exact for products of two shape functions).
struct Tri3 {
  static constexpr int nodes = 3, points = 3;
  static const ShapeTable<3, 2, 3>& table();
};

/// Quadratic triangle, six points (degree 4; Dunavant 1985).
struct Tri6 {
  static constexpr int nodes = 6, points = 6;
  static const ShapeTable<6, 2, 6>& table();
};

/// ∂N_a/∂ξ of the quadratic tetrahedron at its four corners, where it turns inside out first.
const std::array<Eigen::Matrix<double, 10, 3>, 4>& tet10_corner_gradients();

/// N_a of the quadratic tetrahedron at barycentric coordinates @p b (b.sum() = 1), VTK node order.
Eigen::Matrix<double, 10, 1> tet10_shape(const Eigen::Vector4d& b);

/// Nodes of one element, one per row, mm.
template <int Nodes>
using NodeRows = Eigen::Matrix<double, Nodes, 3>;

/// Those of element @p e. @param points  #N by 3, mm   @param nodes  #E by Nodes, in [0, #N)
template <int Nodes>
NodeRows<Nodes> gather(const Points& points, const Indices& nodes, int e) {
  NodeRows<Nodes> rows;
  for (int a = 0; a < Nodes; ++a) rows.row(a) = points.row(nodes(e, a));
  return rows;
}

}  // namespace supine::simulation
