// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/free_parameters.h"

namespace supine::calibration {

/// Young's moduli, kPa, between which breasts and their skin have been found.
struct TissueRange {
  double softest_kpa, stiffest_kpa;
};

/// Of a parameter by its name in model.toml; none where nothing is known of it.
///
/// breast.young_modulus_kpa: 0.2 is the softest of the bodies that move as far as 63 volunteers' breasts do (phantom,
/// docs/supine-phantom.md), 20 lies above fat and gland at small strains (Krouskop et al., Ultrasonic Imaging 20,
/// 1998). skin.young_modulus_kpa: 5 is the softest of those bodies at 1.5 mm, 480 the stiffest of 23 women measured by
/// suction (Sutradhar and Miller, Skin Research and Technology 19, 2013).
std::optional<TissueRange> tissue_range(const std::string& parameter);

/// Rows of @p parameters whose values at @p u no tissue has.
std::vector<Eigen::Index> outside_tissue(const FreeParameters& parameters, const Eigen::VectorXd& u);

}  // namespace supine::calibration
