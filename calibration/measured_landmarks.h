// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "common/landmarks.h"

namespace supine::calibration {

/// Points of the tissue whose places were measured in the imaged pose and in another; #L by 3, mm.
struct MeasuredLandmarks {
  std::vector<std::string> names;
  Points imaged, measured;
  Eigen::VectorXd sigma_mm;  ///< #L, of both places together, 1 sigma along each axis, > 0
};

/// Landmarks of a pose with their places in the image, in the order of @p measured. Variances that the two state add
/// up; 1.5 mm where neither states one.
/// @throws InputError  a measured name that the image does not have
MeasuredLandmarks pair_landmarks(const Landmarks& imaged, const Landmarks& measured);

/// Refuses landmarks that are not where a model may have them: spread three times as far as the predicted places or a
/// third of it, two that fit with their names exchanged (a third of the error left of more than 10 mm), or one more
/// than 60 mm from its place.
/// @param predicted  #L by 3, mm, by a model that need not be calibrated
/// @throws InputError  naming the landmark, the distance, the bound, and metres or a RAS file where that would explain
/// it
void check_landmarks(const MeasuredLandmarks& landmarks, const Points& predicted);

}  // namespace supine::calibration
