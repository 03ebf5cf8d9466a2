// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>

#include "simulation/elements/assembly.h"
#include "simulation/elements/elements.h"

namespace supine::simulation {

/// Area of an undeformed face at one quadrature point and how it changes with the nodes.
template <class Face>
struct FacePoint {
  double area = 0;                               ///< mm², quadrature weight included
  Eigen::Matrix<double, Face::nodes, 3> area_X;  ///< ∂area/∂X_bK, mm
};

/// At quadrature point @p p of the face whose undeformed nodes are @p rest (mm).
/// @tparam Face  Tri3 or Tri6   @pre  0 <= p < Face::points, and the face has an area there
template <class Face>
FacePoint<Face> face_point(const NodeRows<Face::nodes>& rest, int p) {
  const auto& table = Face::table();
  const Eigen::Matrix<double, 3, 2> tangent = rest.transpose() * table.gradient[p];
  const Eigen::Vector3d e1 = tangent.col(0), e2 = tangent.col(1);
  const Eigen::Vector3d normal = e1.cross(e2);
  FacePoint<Face> point;
  const double size = normal.norm();
  point.area = table.weight[p] * size;
  const Eigen::Vector3d unit = normal / size;
  // ∂|e1 × e2|: along e1 it is e2 × n, along e2 it is n × e1.
  const Eigen::Vector3d along1 = e2.cross(unit), along2 = unit.cross(e1);
  point.area_X =
      table.weight[p] * (table.gradient[p].col(0) * along1.transpose() + table.gradient[p].col(1) * along2.transpose());
  return point;
}

/// Adds a density that depends on the interpolated x and X of a surface point: energy ∫ e(x, X) dA with
/// ex = ∂e/∂x, exx = ∂²e/∂x², exX = ∂²e/∂x∂X, dA undeformed; e in mN/mm, so ex in kPa and exx in kPa/mm.
/// @param value  shape functions at the point: Face::table().value[p]
/// @post  the tangent is added to where either tangent is demanded
template <class Face>
void add_point_density(const FacePoint<Face>& point, const Eigen::Matrix<double, Face::nodes, 1>& value, double e,
                       const Eigen::Vector3d& ex, const Eigen::Matrix3d& exx, const Eigen::Matrix3d& exX,
                       const Demand& demand, Local<Face::nodes>& local) {
  constexpr int n = Face::nodes;
  local.energy += point.area * e;
  for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += point.area * value[a] * ex;
  if (!demand.tangent && !demand.reference_tangent) return;
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b) {
      const double weight = point.area * value[a] * value[b];
      local.tangent.template block<3, 3>(3 * a, 3 * b) += weight * exx;
      if (demand.reference_tangent)
        local.reference_tangent.template block<3, 3>(3 * a, 3 * b) +=
            weight * exX + value[a] * ex * point.area_X.row(b);
    }
}

}  // namespace supine::simulation
