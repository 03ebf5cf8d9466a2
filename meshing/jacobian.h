// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Nodes of a quadratic tetrahedron in VTK order, mm, one per row.
using QuadraticNodes = Eigen::Matrix<double, 10, 3>;

/// Nodes of cell @p c. @pre mesh.order() == 2
QuadraticNodes quadratic_nodes(const TetMesh& mesh, Eigen::Index c);

/// The 20 Bernstein coefficients of det ∂x/∂ξ, mm³, over the whole reference tetrahedron. The determinant is a cubic of
/// the barycentric coordinates and never leaves the range of its coefficients; the first four are its values at the
/// corners (Johnen, Remacle, Geuzaine, J. Comput. Phys. 233, 2013, 359-372).
std::array<double, 20> jacobian_coefficients(const QuadraticNodes& nodes);

/// Bounds of the smallest det ∂x/∂ξ of a cell, over that of the tetrahedron with the same corners and straight edges:
/// 1 for straight edges with their nodes in the middle, <= 0 where the cell is turned inside out.
struct ScaledJacobian {
  double low;   ///< no point of the cell is below it
  double high;  ///< a point of the cell has this value
};

/// Subdivides the cell until the bounds are closer than @p tolerance, or until both lie on the same side of @p bound.
/// The pair is proof, up to rounding, that the whole cell is above (low > bound) or that some point is not.
/// @pre  the corners span a positive volume; tolerance > 0
ScaledJacobian smallest_scaled_jacobian(const QuadraticNodes& nodes, double tolerance = 1e-3);
bool scaled_jacobian_exceeds(const QuadraticNodes& nodes, double bound);

/// Volume between the curved faces, exact, mm³.
double curved_volume_mm3(const QuadraticNodes& nodes);

/// Area of a curved boundary face (6 nodes) by Dunavant's six-point rule, mm².
double curved_area_mm2(const Points& points, const Indices& faces, Eigen::Index f);

}  // namespace supine::meshing
