// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// Smooth signed distance to the rigid chest muscle, in mm; positive on the breast's side.
///
/// A tensor-product cubic B-spline on a coarse grid, fitted to samples of the sheet and of its offsets with a
/// bending-energy smoother, so that voxel staircase is gone and the sheet goes on smoothly past its rim.
/// Twice continuously differentiable: value, gradient and Hessian are consistent everywhere.
class MuscleDistance {
 public:
  struct Sample {
    double value_mm;           ///< φ
    Eigen::Vector3d gradient;  ///< ∇φ, close to unit length near the sheet
    Eigen::Matrix3d hessian;   ///< ∇∇φ, 1/mm
  };

  /// @param sheet  breast-facing muscle sheet (open), normals toward the breast
  /// @param reach  box (rows: lower and upper corner, mm) in which φ is wanted; it is widened to hold the sheet and 40
  /// mm around it
  /// @throws InputError  sheet of less than 100 mm²
  MuscleDistance(const reconstruction::Surface& sheet, const Eigen::Matrix<double, 2, 3>& reach);

  /// Outside the box the quadratic expansion at the closest point of the box is used.
  Sample at(const Eigen::Vector3d& point_mm) const;

  /// φ alone; the same number as at(point).value_mm, cheaper.
  double value(const Eigen::Vector3d& point_mm) const;

  /// Root mean square distance between the sheet's points and the zero level, mm.
  double fit_rms_mm() const { return fit_rms_mm_; }

 private:
  Eigen::Vector3d origin_mm_;
  double knot_mm_ = 0;
  Eigen::Vector3i size_;
  std::vector<double> coefficients_;
  double fit_rms_mm_ = 0;
};

}  // namespace supine::meshing
