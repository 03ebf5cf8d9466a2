// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace supine::diagnosis {

/// A density of one number that is no normal one, known by its logarithm at a few places: between them by Akima's
/// modified curve through the logarithms, beyond them falling on as it fell last, level where it rose, nothing outside
/// [lower, upper].
class CurvedDensity {
 public:
  /// @param at  ascending, four or more, inside [lower, upper]
  /// @param ln  of the density there, up to a constant
  /// @throws std::invalid_argument  fewer than four places, or not ascending
  CurvedDensity(std::vector<double> at, std::vector<double> ln, double lower, double upper);

  /// ln of the integral.
  double ln_mass() const { return ln_mass_; }
  /// Value below which the share @p p of the mass lies. @pre 0 < p < 1
  double quantile(double p) const;

 private:
  Eigen::VectorXd place_, below_;  // trapezoids: mass below each place, of 1
  double ln_mass_ = 0;
};

}  // namespace supine::diagnosis
