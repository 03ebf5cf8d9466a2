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

// Three directions B = e_J of unit weight in place of an element's shape gradients.
void bulk_tangent(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m, const Edges& rest, Matrix3& stress,
                  Tangent9& tangent) {
  const Demand demand{.residual = true, .tangent = true};
  const bool symmetric = law != BulkLaw::corotational_qr;
  const Nodal<3> directions = Nodal<3>::Identity();
  ElementSums<3> sums;
  sums.clear(demand);
  if (is_invariant_law(law)) {
    const InvariantStrain strain(f);
    add_invariant_point<3>(strain, invariant_response(law, strain, m), directions, 1, demand, sums);
  } else if (law == BulkLaw::corotational) {
    add_polar_point<3>(PolarPoint(f), m, 0, directions, 1, demand, sums);
  } else {
    add_qr_point<3>(f, rest, m, directions, 1, Eigen::Matrix<double, 3, 2>::Zero(), demand, sums);
  }
  stress = sums.force.transpose();
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      const bool mirrored = symmetric && k < i;
      const Matrix3& part = sums.tangent[mirrored ? 3 * k + i : 3 * i + k];
      tangent.block<3, 3>(3 * i, 3 * k) = mirrored ? Matrix3(part.transpose()) : part;
    }
}

}  // namespace supine::simulation
