// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/arrays.h"
#include "simulation/fields.h"

namespace supine::calibration {

/// What a model says of where a scan lies in the frame of the image (Fields::scan_motion of its pose): a shift t in mm
/// and a rotation vector r in rad about the scan's centroid. With g the centroid of the scan as given, a point y of it
/// belongs at g + Rᵀ(y − g) − t.
class ScanMotion {
 public:
  /// @param motion  Fields::scan_motion, 6
  /// @param scan    all points of the scan as given, #P by 3, mm
  ScanMotion(const Eigen::VectorXd& motion, const Points& scan);

  /// Points of the scan as given → where they belong.
  Points corrected(const Points& given) const;
  /// Points in the frame of the image → in that of the scan as given; the inverse of corrected().
  Points as_given(const Points& corrected) const;
  /// Directions, likewise.
  Points directions_as_given(const Points& directions) const;

 private:
  Eigen::Vector3d shift_, centroid_;
  Eigen::Matrix3d rotation_;
  bool none_;
};

/// Derivative of ScanMotion::corrected() of points that were measured with a scan, with respect to the parameter that
/// @p motion carries the derivative of; #P by 3, mm per unit.
/// @param scan  all points of the scan as given: their centroid is what is turned about
Points corrected_derivative(const simulation::Fields<simulation::Dual>::Column& motion, const Points& scan,
                            const Points& points);

}  // namespace supine::calibration
