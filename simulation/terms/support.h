// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/elements/elements.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// A support that tissue does not slide on: springs on its faces, force-free in the undeformed shape. Energy per
/// undeformed area ½ k_n (n·u)² + ½ k_t |u − (n·u) n|², u = x − X, n the imaged face's unit normal. Over a flat support
/// the mean turn under a moment M is M / (k_n ∫y² dA), the mean shift across under a force F is F / (k_t A).
template <class Face>
class SupportTerm : public Term {
 public:
  /// @param imaged       nodes of the imaged mesh, #N by 3, mm
  /// @param first_point  row of the interface's fields that belongs to the first point of the first face
  SupportTerm(const Indices& faces, const Pattern& pattern, const Points& imaged, Eigen::Index first_point);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  /// Of one point, for stiffness along and across the normal.
  Eigen::Matrix3d spring(Eigen::Index point, double normal, double tangential) const;

  Elements elements_;
  Points normal_;  // per point, unit
  Eigen::Index first_point_;
  Eigen::VectorXd along_, across_;  // per point, kPa/mm
};

extern template class SupportTerm<Tri3>;
extern template class SupportTerm<Tri6>;

}  // namespace supine::simulation
