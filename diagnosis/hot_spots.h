// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "calibration/model_skin.h"
#include "calibration/residuals.h"

namespace supine::diagnosis {

/// A connected piece of skin over which the model is off to one side.
struct HotSpot {
  std::string area, pose;           ///< the anatomical area that holds most of it
  double area_cm2, mean_signed_mm;  ///< > 0 where the scan lies outside the model
  Eigen::Vector3d centre_mm;        ///< in that pose
};

struct HotSpotRules {
  double least_mm = 0.5;    ///< off by less is no hot spot
  double noise_factor = 2;  ///< nor less than this many standard errors of what was averaged
  double least_cm2 = 4;     ///< nor a smaller piece
};

/// Distances of one pose carried to the skin's nodes (NaN where no scan point is near) and smoothed over neighbours.
struct SkinError {
  Eigen::VectorXd mean_mm;   ///< #N, mesh points
  Eigen::VectorXd error_mm;  ///< #N, standard error from the noise
};

SkinError skin_error(const calibration::ModelSkin& skin, const calibration::Residuals& residuals,
                     const calibration::Prediction& prediction, std::size_t pose);

/// Largest first (area × |mean|).
/// @param skin   in the pose   @param areas  may be empty: then no names
std::vector<HotSpot> find_hot_spots(const calibration::ModelSkin& skin, const SkinError& error,
                                    const calibration::SkinAreas& areas, const std::string& pose,
                                    const HotSpotRules& rules = {});

}  // namespace supine::diagnosis
