// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

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
  GravityTerm(std::shared_ptr<const Elements> cells, const Points& imaged, DensityReference reference);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  Eigen::VectorXd nodal_forces(const Points& shape, const Points& weight) const;
  void add_varying(const State& state, const Demand& demand, Sums& sums) const;
  void add_mass_derivative(const State& state, const Points& imaged_velocity, Sums& sums) const;

  std::shared_ptr<const Elements> shared_;
  const Elements& elements_;
  Points given_, imaged_;  // as segmented, and moved by the offset
  DensityReference reference_;
  Points weight_;              // per cell: density × gravity, mN/mm³
  Eigen::VectorXd dead_load_;  // of DensityReference::imaged: 3 per node, mN
};

extern template class GravityTerm<Tet4>;
extern template class GravityTerm<Tet10>;

}  // namespace supine::simulation
