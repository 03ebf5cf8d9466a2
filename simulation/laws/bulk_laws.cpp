// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/laws/bulk_laws.h"

#include "simulation/laws/invariant_kernel.h"

namespace supine::simulation {

const std::vector<std::pair<std::string, BulkLaw>>& bulk_law_names() {
  static const std::vector<std::pair<std::string, BulkLaw>> names = {
#define SUPINE_NAME(name, Law) {#name, BulkLaw::name},
      SUPINE_INVARIANT_LAWS(SUPINE_NAME)
#undef SUPINE_NAME
          {"corotational", BulkLaw::corotational},
      {"corotational_qr", BulkLaw::corotational_qr}};
  return names;
}

std::string name_of(BulkLaw law) {
  for (const auto& [name, value] : bulk_law_names())
    if (value == law) return name;
  return {};
}

double bulk_energy(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m) {
  if (is_invariant_law(law)) return invariant_response(law, InvariantStrain(f), m).energy;
  return PolarPoint(f).energy(m);
}

void bulk_tangent(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m, const Edges& rest, Matrix3& stress,
                  Tangent9& tangent) {
  const Demand demand{.residual = true, .tangent = true};
  ElementSums<3> sums;
  sums.clear(demand);
  if (is_invariant_law(law)) {
    const InvariantStrain strain(f);
    add_invariant_point<3>(strain, invariant_response(law, strain, m), unit_gradients, 1, demand, sums);
  } else if (law == BulkLaw::corotational) {
    add_polar_point<3>(PolarPoint(f), m, 0, unit_gradients, 1, demand, sums);
  } else {
    add_qr_point<3>(f, rest, m, unit_gradients, 1, Eigen::Matrix<double, 3, 2>::Zero(), demand, sums);
  }
  stress = sums.force.transpose();
  tangent = point_tangent(sums, law != BulkLaw::corotational_qr);
}

}  // namespace supine::simulation
