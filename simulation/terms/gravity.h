// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/elements/elements.h"
#include "simulation/model.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// Weight of the tissue. With DensityReference::imaged the mass of each node comes from the imaged volume and stays:
/// the imaged nodes moved by Fields::imaged_offset. With undeformed it is ρ × undeformed volume and enters ∂r/∂X.
template <class Element>
class GravityTerm : public Term {
 public:
  /// @param imaged  prone nodes as segmented, mm
  GravityTerm(const Indices& cells, const Pattern& pattern, const Points& imaged, DensityReference reference);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  void add_force(const State& state, const Points& weight, const Demand& demand, Sums& sums) const;
  void add_mass_derivative(const State& state, const Points& imaged_velocity, Sums& sums) const;

  Elements elements_;
  Points given_, imaged_;  // as segmented, and moved by the offset
  DensityReference reference_;
  Points weight_;  // per cell: density × gravity, mN/mm³
};

extern template class GravityTerm<Tet4>;
extern template class GravityTerm<Tet10>;

}  // namespace supine::simulation
