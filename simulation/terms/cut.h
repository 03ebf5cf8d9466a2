// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/elements/elements.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// The body that goes on behind the cut: springs -k_c (x - X) per undeformed area, force-free in the undeformed shape.
template <class Face>
class CutTerm : public Term {
 public:
  /// @param share  of the stiffness, 0 to 1, #faces × Face::points as fade_from_skin_end gives it; empty: all of it
  CutTerm(const Indices& faces, const Pattern& pattern, Eigen::VectorXd share);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  double share(Eigen::Index point) const { return share_.size() > 0 ? share_[point] : 1; }

  Elements elements_;
  Eigen::VectorXd share_;
  Eigen::VectorXd stiffness_;  // per point, kPa/mm
};

extern template class CutTerm<Tri3>;
extern template class CutTerm<Tri6>;

}  // namespace supine::simulation
