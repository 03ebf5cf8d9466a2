// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "simulation/bulk_laws.h"
#include "simulation/elements.h"
#include "simulation/term.h"

namespace supine::simulation {

/// Elasticity of the tissue: r_ai = ∫ P_iJ ∂N_a/∂X_J dV over the undeformed volume.
/// ∂r/∂X follows from ∂B_aJ/∂X_bK = -B_aK B_bJ and ∂V/∂X_bK = V B_bK (B = ∂N/∂X); see docs/mechanics.md.
/// @tparam Element  Tet4 or Tet10
template <class Element>
class BulkTerm : public Term {
 public:
  /// @throws InputError  corotational_qr on quadratic cells: the study defines it for linear ones
  BulkTerm(const Indices& cells, const Pattern& pattern, BulkLaw law);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;
  bool has_energy() const override { return law_ != BulkLaw::corotational_qr; }

 private:
  void add_cell(int e, const State& state, const Demand& demand, Local<Element::nodes>& local) const;

  Elements elements_;
  BulkLaw law_;
  std::vector<BulkMaterial<double>> material_;  // per cell
};

extern template class BulkTerm<Tet4>;
extern template class BulkTerm<Tet10>;

}  // namespace supine::simulation
