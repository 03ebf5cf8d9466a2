// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "meshing/anatomy/chest_beside.h"
#include "simulation/elements/elements.h"
#include "simulation/model.h"
#include "simulation/terms/contact_figures.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// Skin on the chest beside the breast, without friction: energy Σ_p A_p × share × contact_energy(gap) over the
/// quadrature points p of the skin (meshing/anatomy/chest_beside.h, laws/skin_contact_law.h), A_p the imaged area, so
/// that nothing in it depends on the undeformed shape.
///
/// Left out are points whose gap is within the band in the imaged or in the undeformed shape: like every spring the
/// term is free of force there.
class ChestContact : public Term {
 public:
  virtual const LeftOut& left_out_imaged() const = 0;
  /// Beyond those left out in the imaged shape. @param X  #N by 3, mm
  virtual LeftOut left_out(const Points& X) const = 0;
  virtual ContactFigures figures(const State& state) const = 0;
};

template <class Face>
class ChestContactTerm : public ChestContact {
 public:
  /// @param faces  the skin's   @param imaged  nodes, #N by 3, mm
  ChestContactTerm(const Indices& faces, const Pattern& pattern, const Points& imaged, meshing::ChestBeside chest,
                   const ContactSettings& settings);

  void set_fields(const Fields<double>&) override {}
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State&, const Fields<Dual>&, Sums&) const override {}  // no field enters

  const LeftOut& left_out_imaged() const override { return imaged_left_out_; }
  LeftOut left_out(const Points& X) const override;
  ContactFigures figures(const State& state) const override;

 private:
  void add_face(int e, const State& state, const std::vector<char>& acts, const Demand& demand,
                Local<Face::nodes>& local) const;
  LeftOut leave_out(const Points& shape, std::vector<char>& acts) const;
  /// Per point: whether it may touch. @post  of imaged_acts_ those that do not touch in @p X
  const std::vector<char>& acts_from(const Points& X) const;

  Elements elements_;
  meshing::ChestBeside chest_;
  ContactSettings settings_;
  Eigen::VectorXd area_mm2_;  // per point, imaged
  std::vector<char> imaged_acts_;
  LeftOut imaged_left_out_;
  // Of the undeformed shape asked for last: it stays the same throughout a forward solve.
  mutable Points undeformed_;
  mutable std::vector<char> undeformed_acts_;
  mutable LeftOut undeformed_left_out_;
};

extern template class ChestContactTerm<Tri3>;
extern template class ChestContactTerm<Tri6>;

}  // namespace supine::simulation
