// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "calibration/evaluator.h"
#include "calibration/residuals.h"
#include "simulation/mechanics.h"

namespace supine::diagnosis {

/// How uneven every body is: standard deviations, and the lengths in mm over which they are alike.
struct Patchiness {
  double tissue = 0.25, tissue_length_mm = 20;    ///< of ln E
  double skin = 0.15, skin_length_mm = 25;        ///< of the ln of the skin's stiffness
  double muscle_mm = 0.7, muscle_length_mm = 30;  ///< of the muscle's place in every pose but the imaged one
};

/// The shapes of the three fields, one standard deviation each. What the modulus of the tissue, that of the skin and a
/// hill under the mound can make up for is taken out of them.
struct PatchyFields {
  Eigen::MatrixXd tissue;  ///< #cells by up to 40, of ln E
  Eigen::MatrixXd skin;    ///< #skin faces by up to 40, of the ln of the stiffness
  Eigen::MatrixXd muscle;  ///< #interface points by up to 40, mm along the muscle's normal
};

PatchyFields patchy_fields(const simulation::Mechanics& mechanics, const Patchiness& patchiness);

/// Each shape as a change of the fields of a pose, tissue, then skin, then muscle. @param chain  must outlive them
std::vector<simulation::Sensitivities::FieldDirection> patchy_directions(const simulation::Chain& chain,
                                                                         const Patchiness& patchiness);

/// What uneven tissue, uneven skin and a muscle that lies elsewhere do to the distances, to first order: one column per
/// shape of each field (field_modes.h), #R by 3 × up to 40, mm, each one standard deviation.
/// @param sensitivities  of the prediction's solution by @p chain
Eigen::MatrixXd patchiness_shapes(const simulation::Chain& chain, const simulation::Sensitivities& sensitivities,
                                  const calibration::Prediction& prediction, const calibration::Residuals& residuals,
                                  const Patchiness& patchiness);

}  // namespace supine::diagnosis
