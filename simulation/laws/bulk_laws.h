// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "simulation/laws/invariant_laws.h"
#include "simulation/laws/point_tangent.h"
#include "simulation/laws/rotation_laws.h"

namespace supine::simulation {

/// Names of breast.law in model.toml.
const std::vector<std::pair<std::string, BulkLaw>>& bulk_law_names();
std::string name_of(BulkLaw law);

/// Strain energy density, kPa. Zero at F = I. @pre det F > 0; not for corotational_qr, which has none
double bulk_energy(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m);

/// First Piola-Kirchhoff stress P = ∂W/∂F, kPa; T = Dual carries the derivative with respect to the material.
/// @param rest      undeformed edges, used by corotational_qr only
/// @param pressure  of the cell's mean volume, kPa (bulk.h): adds it times ∂J/∂F, or times R for the corotational laws
template <class T>
Eigen::Matrix<T, 3, 3> bulk_stress(BulkLaw law, const Matrix3& f, const BulkMaterial<T>& m, const Edges& rest,
                                   const T& pressure = T(0.0)) {
  if (is_invariant_law(law)) {
    const InvariantStrain strain(f);
    InvariantResponse<T> response = invariant_response(law, strain, m);
    response.wl += pressure * strain.j;  // ∂J/∂L
    return stress_of(strain, response);
  }
  const Matrix3 r = law == BulkLaw::corotational ? polar_rotation(f) : qr_rotation(f, rest);
  Eigen::Matrix<T, 3, 3> p = corotated_stress<T>(f, r, m.mu_kpa, m.lambda_kpa);
  for (int i = 0; i < 9; ++i) p.data()[i] += pressure * r.data()[i];
  return p;
}

/// P and ∂P/∂F together, from the sums the element matrices are made of.
void bulk_tangent(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m, const Edges& rest, Matrix3& stress,
                  Tangent9& tangent);

}  // namespace supine::simulation
