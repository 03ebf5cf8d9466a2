// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>

#include "diagnosis/targets/regions.h"

namespace supine::diagnosis {

/// The part of regions that goes through parameters and nuisances, held against draws of them through the whole chain.
struct DrawnPlaces {
  int draws = 0, failed = 0;     ///< failed: no equilibrium
  Eigen::VectorXd linear_sd_mm;  ///< #P, along an axis, rms, by the derivatives
  Eigen::VectorXd drawn_sd_mm;   ///< #P, of the draws
  Eigen::VectorXd mean_off_mm;   ///< #P, mean of the draws from that of the derivatives
  Eigen::VectorXd inside;        ///< #P, share of the draws in the 95 % ellipsoid of the derivatives
};

/// @param free     of the model that the regions were found for
/// @param regions  of the same question
/// @param near     solution of the model where it stands, or nullptr
DrawnPlaces draw_places(const TargetQuestion& question, const calibration::FreeParameters& free,
                        const TargetRegions& regions, const simulation::ChainSolution* near, int draws, unsigned seed,
                        const std::function<void(int)>& progress = {});

}  // namespace supine::diagnosis
