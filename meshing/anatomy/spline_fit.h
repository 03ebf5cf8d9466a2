// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "meshing/anatomy/spline_basis.h"

namespace supine::meshing {

/// Linear least squares for the coefficients of a tensor-product cubic spline in three coordinates:
/// Σ weight (φ(sample) - value)² + Σ weight ∫ ‖∇^m φ‖² dV, minimal.
class SplineFit {
 public:
  /// @param size     coefficients per axis, x fastest
  SplineFit(const Eigen::Vector3i& size, double knot_mm);

  void add_sample(const std::array<SplineWeights, 3>& w, double value, double weight);

  /// Adds Σ_m weight[m] ∫ ‖∇^m φ‖² dV for m = 0 … 3; weight[m] in mm^(2m - 1) where samples weigh 1 mm².
  void add_energy(const std::array<double, 4>& weight);

  /// @throws NumericalFailure  when samples and energy leave coefficients undetermined
  Eigen::VectorXd solve() const;

 private:
  // Each coefficient couples with those at most 3 away along every axis; of these 343 the ones that come first are
  // kept.
  static constexpr int half = 172;
  int index(int i, int j, int k) const { return i + size_.x() * (j + size_.y() * k); }

  Eigen::Vector3i size_;
  double knot_mm_;
  std::vector<double> matrix_;  // size.prod() by half
  Eigen::VectorXd right_;
};

}  // namespace supine::meshing
