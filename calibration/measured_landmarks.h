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

/// 1 sigma of a landmark's two places together, mm: variances that the two files state add up; 1.5 where neither states
/// one.
double pair_sigma_mm(const Landmarks& imaged, Eigen::Index imaged_row, const Landmarks& measured,
                     Eigen::Index measured_row);

/// Landmarks of a pose with their places in the image, in the order of @p measured, known to pair_sigma_mm().
/// @throws InputError  a measured name that the image does not have
MeasuredLandmarks pair_landmarks(const Landmarks& imaged, const Landmarks& measured);

/// Refuses landmarks that are not where a model may have them: spread three times as far as the predicted places or a
/// third of it, two that fit with their names exchanged (a third of the error left of more than 10 mm), or one more
/// than 60 mm from its place.
/// @param predicted  #L by 3, mm, by a model that need not be calibrated
/// @throws InputError  naming the landmark, the distance, the bound, and metres or a RAS file where that would explain
/// it
void check_landmarks(const MeasuredLandmarks& landmarks, const Points& predicted);

/// What to doubt of landmarks that may be right: spread otherwise by a sixth or more than the model has them, where
/// that alone explains half of what is off (more than 2 sigma, RMS). Empty: nothing.
/// @param predicted  as above
std::string doubt_of_scale(const MeasuredLandmarks& landmarks, const Points& predicted);

}  // namespace supine::calibration
