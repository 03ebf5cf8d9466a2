// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "registration/fit.h"

namespace supine::registration {

/// The answer for one scan.
struct Registration {
  Fit fit;
  double noise_mm = 0;                 ///< that was reckoned with
  double before_mm = 0, after_mm = 0;  ///< match_score_mm() of the same points, as given (or started) and found
  double landmarks_before_mm = 0, landmarks_after_mm = 0;  ///< RMS; 0 without landmarks
  double overlap = 0;                                      ///< overlap() where found
  int other_places = 0;       ///< other placements that fit nearly as well; the covariance includes them
  std::string axes;           ///< named_axis_change() of the turn
  bool given_inside = false;  ///< the 95 % region holds the given place
  bool searched_far = false;  ///< nothing fitted near the given place

  bool worse_than_given() const { return after_mm > before_mm || landmarks_after_mm > landmarks_before_mm; }
};

/// Finds scan → image.
/// @param given  where the scan is said to lie; without landmarks the search begins here, and the answer is compared
///   with it
/// @param noise_known  false: problem.noise_mm is replaced by an estimate from the residuals
/// @param name  of the scan's file, for messages
/// @throws InputError  as check_unit() and check_mirror(); no landmarks and no surface; nothing that fits: fewer than
/// 30 % of the scan meets
///   the body, or the RMS is above 8 mm, or landmarks are further than 25 mm off (RMS)
Registration register_scan(Problem problem, const RigidTransform& given, bool noise_known, const std::string& name);

/// Directions in which the geometry does not hold the scan.
struct WeakDirection {
  Eigen::Vector3d axis;  ///< unit, frame of the image
  double sd;             ///< mm, or rad about the axis
  bool turn;
};
/// Shifts known to worse than 5 mm and turns to worse than 5° (1 sigma), the worst first.
std::vector<WeakDirection> weak_directions(const Fit& fit);

}  // namespace supine::registration
