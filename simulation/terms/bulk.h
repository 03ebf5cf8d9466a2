// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "simulation/elements/elements.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/terms/volume_strain.h"

namespace supine::simulation {

struct BulkSettings {
  BulkLaw law = BulkLaw::neo_hookean;
  Volumetric volumetric = Volumetric::mean;
};

/// λ up to which every quadrature point of a cell resists a change of its own volume, as a multiple of μ: ν = 1/3.
inline constexpr double pointwise_lambda_over_mu = 2.0;

/// λ split into a part that acts at every quadrature point and the excess that acts on the cell's mean dilation:
/// λ = pointwise + excess, excess = 0 up to pointwise_lambda_over_mu and smooth (C1) beyond.
template <class T>
struct SplitLambda {
  T pointwise, excess;
};
template <class T>
SplitLambda<T> split_lambda(const BulkMaterial<T>& m);

/// What to tell the user where cells of this order lock: linear ones above ν = 0.46, quadratic ones above 0.48 with the
/// volume pointwise. Empty where they do not. @param poisson  #cells
std::string locking_warning(int order, const Eigen::VectorXd& poisson, Volumetric volumetric);

/// Elasticity of the tissue: r_ai = ∫ P_iJ ∂N_a/∂X_J dV over the undeformed volume, plus, where quadratic cells would
/// lock, V excess/2 ln²Ĵ with Ĵ the ratio of the cell's deformed to its undeformed volume V (Simo, Taylor and Pister
/// 1985); (Ĵ - 1)² for neo_hookean_calculix, the square of the mean of tr U - 3 for corotational. ∂r/∂X is exact; see
/// docs/mechanics.md.
/// @tparam Element  Tet4 or Tet10
template <class Element>
class BulkTerm : public Term, public VolumeStrainTerm {
 public:
  /// @throws InputError  corotational_qr on quadratic cells: the study defines it for linear ones
  BulkTerm(std::shared_ptr<const Elements> cells, const BulkSettings& settings);

  /// @throws InputError  mooney_rivlin with λ < 4 C01 in a cell: its volumetric energy would not be convex
  void set_fields(const Fields<double>& fields) override;
  /// A state that a law has no energy for (gent beyond its limit) is reported like an inverted cell, min_det_f <= 0.
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;
  bool has_energy() const override { return settings_.law != BulkLaw::corotational_qr; }

  bool nearly_incompressible() const override;
  void volume_strain(const State& state, const Eigen::VectorXd& step, Eigen::VectorXd& strain,
                     Eigen::VectorXd& change) const override;
  void take_off_pressure_defect(const State& state, Eigen::VectorXd& residual) const override;

 private:
  template <class T>
  struct CellMaterial {
    BulkMaterial<T> point;  // λ is the pointwise part
    T excess;
  };
  template <class T>
  CellMaterial<T> cell_material(const Fields<T>& fields, Eigen::Index cell) const;
  void add_cell(int e, const State& state, const Demand& demand, Local<Element::nodes>& local) const;
  void add_cell_derivative(int e, const State& state, const CellMaterial<Dual>& material,
                           Local<Element::nodes>& local) const;

  std::shared_ptr<const Elements> shared_;
  const Elements& elements_;
  BulkSettings settings_;
  std::vector<CellMaterial<double>> material_;  // per cell
};

extern template class BulkTerm<Tet4>;
extern template class BulkTerm<Tet10>;

}  // namespace supine::simulation
