// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/elements/elements.h"
#include "simulation/laws/skin_laws.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// Linear triangle with its centroid alone: exact for a membrane, whose strain does not vary over such a face.
struct Tri3Centroid {
  static constexpr int nodes = 3, points = 1;
  static const ShapeTable<3, 2, 1>& table();
};

/// Massless elastic membrane on the skin faces, without bending stiffness: energy ∫ E h ψ(Cs) dA over the undeformed
/// area, Cs the in-plane Cauchy-Green tensor times prestretch². With metrics G (undeformed) and g (deformed) of the
/// parent coordinates, λ1² + λ2² = tr(G⁻¹ g) and λ1² λ2² = det g / det G, so that x and X play alike roles.
/// @tparam Face  Tri3Centroid or Tri6
template <class Face>
class SkinTerm : public Term {
 public:
  /// @param share  of the stiffness, 0 to 1, #faces × Face::points as fade_from_skin_end gives it; empty: all of it
  SkinTerm(const Indices& faces, const Pattern& pattern, const SkinSettings& settings, Eigen::VectorXd share);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  double weight_of(int e, int p) const;
  void add_face(int e, const State& state, const Demand& demand, Local<Face::nodes>& local) const;

  Elements elements_;
  SkinSettings settings_;
  Eigen::VectorXd share_;
  std::vector<SkinMaterial<double>> material_;  // per face
};

extern template class SkinTerm<Tri3Centroid>;
extern template class SkinTerm<Tri6>;

}  // namespace supine::simulation
