// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "simulation/model.h"
#include "simulation/terms/contact_figures.h"
#include "simulation/terms/contact_point.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// Skin on skin, without friction: energy Σ_p A_p/2 × coverage × contact_energy(gap) over the samples p of both skins
/// (contact_point.h), A_p the imaged area, so that nothing in it depends on the undeformed shape. Forces and moments of
/// a pair are in balance: the energy is blind to motions of the whole.
///
/// Left out are pairs of neighbouring faces, and those whose gap is within the band in the imaged or in the undeformed
/// shape: like every spring the term is free of force there.
class SkinContactTerm : public Term {
 public:
  /// @param faces   the skin's, #F by 3 or 6   @param imaged  nodes, #N by 3, mm
  SkinContactTerm(const Indices& faces, const Points& imaged, const ContactSettings& settings);

  void set_fields(const Fields<double>&) override {}
  /// @post  the tangent stands in sums.contact
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State&, const Fields<Dual>&, Sums&) const override {}  // no field enters

  /// Left out in the imaged shape, and beyond those in the undeformed one. @param X  #N by 3, mm
  const LeftOut& left_out_imaged() const { return imaged_left_out_; }
  LeftOut left_out(const Points& X) const;
  ContactFigures figures(const State& state) const;

  /// The share of a step after which no part of the skin is further than half its reach behind skin that it faces now:
  /// from there the forces lead back. @param x  #N by 3, mm   @param step  3 per node, mm
  double safe_share(const Points& x, const Eigen::VectorXd& step) const;

 private:
  struct Touching {
    SkinPairs::Group group;
    ContactPoint point;
  };
  /// The samples of a shape whose gap is within the band.
  std::vector<Touching> touching(const SkinPairs& pairs, const SkinShape& shape) const;
  LeftOut leave_out(const SkinShape& shape, SkinPairs& pairs) const;
  /// pairs_ without those that touch in @p X.
  const SkinPairs& pairs_of(const Points& X) const;
  void add_tangent(const std::vector<ContactDerivatives>& parts, Sums& sums) const;

  ContactSettings settings_;
  SkinSamples samples_;
  SkinPairs pairs_;
  LeftOut imaged_left_out_;
  // Of the undeformed shape asked for last: it stays the same throughout a forward solve.
  mutable Points undeformed_;
  mutable std::unique_ptr<SkinPairs> undeformed_pairs_;
  mutable LeftOut undeformed_left_out_;
};

}  // namespace supine::simulation
