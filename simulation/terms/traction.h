// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/elements/elements.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// A dead load on the skin: traction t in kPa per undeformed area, fixed in space, whatever way the skin turns.
/// Energy -load ∫ t·x dA, so that a face carries t × its undeformed area.
template <class Face>
class TractionTerm : public Term {
 public:
  TractionTerm(const Indices& faces, const Pattern& pattern);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  void add_force(const State& state, const Points& traction, const Demand& demand, Sums& sums) const;

  Elements elements_;
  Points traction_;      // per face, kPa
  bool loaded_ = false;  // some face carries something
};

extern template class TractionTerm<Tri3>;
extern template class TractionTerm<Tri6>;

}  // namespace supine::simulation
