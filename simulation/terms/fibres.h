// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

#include "meshing/anatomy/muscle_distance.h"
#include "simulation/elements/elements.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// Fibres that pull when stretched (Cooper's ligaments, fascia to skin): k_f/4 ⟨I4 - 1⟩² per undeformed volume with
/// I4 = |F a|², a = ∇φ/|∇φ| the muscle's outward normal at the undeformed place of the quadrature point, ⟨⟩ the
/// positive part (Holzapfel and Gasser 2001 with the quadratic form of Weiss et al. 1996). Once continuously
/// differentiable. a moves with X and stands in ∂r/∂X. Where every k_f is zero, add() does nothing.
/// @tparam Element  Tet4 or Tet10
template <class Element>
class FibreTerm : public Term {
 public:
  FibreTerm(std::shared_ptr<const Elements> cells, std::shared_ptr<const meshing::MuscleDistance> muscle);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  void add_all(const State& state, const Eigen::VectorXd& modulus, const Demand& demand, Sums& sums) const;

  std::shared_ptr<const Elements> shared_;
  const Elements& elements_;
  std::shared_ptr<const meshing::MuscleDistance> muscle_;
  Eigen::VectorXd modulus_;  // per cell, kPa
  bool any_ = false;
};

extern template class FibreTerm<Tet4>;
extern template class FibreTerm<Tet10>;

}  // namespace supine::simulation
