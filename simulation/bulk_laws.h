// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "simulation/model.h"

namespace supine::simulation {

using Matrix3 = Eigen::Matrix3d;
/// ∂P_iJ/∂F_kL at row 3i+J, column 3k+L, kPa.
using Tangent9 = Eigen::Matrix<double, 9, 9>;

/// Lamé parameters and stiffening of one cell.
template <class T>
struct BulkMaterial {
  T mu_kpa;      ///< E / (2 (1 + ν))
  T lambda_kpa;  ///< E ν / ((1 + ν)(1 - 2ν))
  T stiffening;  ///< b of μ/2 (e^{b(I1-3)} - 1)/b; 0 = none; neo_hookean only
};

template <class T>
BulkMaterial<T> bulk_material(const T& young_kpa, const T& poisson, const T& stiffening) {
  return {young_kpa / (2.0 * (1.0 + poisson)), young_kpa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
          stiffening};
}

/// Rotation factor of F = R U, det F > 0 (Newton iteration of Higham 1986).
Matrix3 polar_rotation(const Matrix3& f);

/// Orthonormal frame whose first two columns span those of @p edges, by Gram-Schmidt in column order.
template <class T>
Eigen::Matrix<T, 3, 3> frame_of_edges(const Eigen::Matrix<T, 3, 2>& edges) {
  using std::sqrt;
  Eigen::Matrix<T, 3, 3> q;
  q.col(0) = edges.col(0) / sqrt(edges.col(0).squaredNorm());
  const Eigen::Matrix<T, 3, 1> second = edges.col(1) - q.col(0) * q.col(0).dot(edges.col(1));
  q.col(1) = second / sqrt(second.squaredNorm());
  q.col(2) = q.col(0).cross(q.col(1));
  return q;
}

/// Rotation of the study's law (Nesme et al. 2005): the frame of the first two deformed edges against that of the
/// two undeformed edges @p rest (X1 - X0, X2 - X0).
template <class T>
Eigen::Matrix<T, 3, 3> qr_rotation(const Eigen::Matrix<T, 3, 3>& f, const Eigen::Matrix<T, 3, 2>& rest) {
  const Eigen::Matrix<T, 3, 2> deformed = f * rest;
  return frame_of_edges<T>(deformed) * frame_of_edges<T>(rest).transpose();
}

/// First Piola-Kirchhoff stress of Hooke's law in the rotated frame: R (2με + λ tr ε), ε = sym(RᵀF) - I.
/// For the polar R this is the derivative of μ‖F-R‖² + λ/2 tr²(RᵀF - I).
template <class T, class F>
Eigen::Matrix<T, 3, 3> corotated_stress(const Eigen::Matrix<F, 3, 3>& f, const Eigen::Matrix<F, 3, 3>& r, const T& mu,
                                        const T& lambda) {
  const Eigen::Matrix<F, 3, 3> s = r.transpose() * f;
  const Eigen::Matrix<F, 3, 3> strain = F(0.5) * (s + s.transpose()) - Eigen::Matrix<F, 3, 3>::Identity();
  Eigen::Matrix<T, 3, 3> stress = (T(2.0) * mu) * strain.template cast<T>();
  stress.diagonal().array() += lambda * T(strain.trace());
  return r.template cast<T>() * stress;
}

/// Strain energy density, kPa. Zero at F = I. @pre det F > 0; not for corotational_qr, which has none
double bulk_energy(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m);

/// First Piola-Kirchhoff stress P = ∂W/∂F, kPa; T = Dual carries the derivative with respect to the material.
/// @param rest  undeformed edges X1 - X0, X2 - X0, used by corotational_qr only
template <class T>
Eigen::Matrix<T, 3, 3> bulk_stress(BulkLaw law, const Matrix3& f, const BulkMaterial<T>& m,
                                   const Eigen::Matrix<double, 3, 2>& rest) {
  using std::exp;
  if (law == BulkLaw::corotational) return corotated_stress<T, double>(f, polar_rotation(f), m.mu_kpa, m.lambda_kpa);
  if (law == BulkLaw::corotational_qr)
    return corotated_stress<T, double>(f, qr_rotation<double>(f, rest), m.mu_kpa, m.lambda_kpa);
  const Matrix3 g = f.inverse().transpose();
  const double log_j = std::log(f.determinant());
  const T growth = exp(m.stiffening * T(f.squaredNorm() - 3.0));
  return (m.mu_kpa * growth) * f.template cast<T>() + (m.lambda_kpa * T(log_j) - m.mu_kpa) * g.template cast<T>();
}

/// P and ∂P/∂F together.
void bulk_tangent(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m, const Eigen::Matrix<double, 3, 2>& rest,
                  Matrix3& stress, Tangent9& tangent);

/// ∂P_iJ/∂(rest edge component) at fixed F for corotational_qr: row 3i+J, column 3c+K for component K of edge c.
Eigen::Matrix<double, 9, 6> qr_rest_derivative(const Matrix3& f, const BulkMaterial<double>& m,
                                               const Eigen::Matrix<double, 3, 2>& rest);

}  // namespace supine::simulation
