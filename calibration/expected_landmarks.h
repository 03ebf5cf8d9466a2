// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "common/landmarks.h"

namespace supine::calibration {

/// Where landmarks are expected in a pose, and how far off they may be measured there.
struct ExpectedPlaces {
  std::vector<std::string> names;
  Points places;  ///< #L by 3, mm, in the frame of the measured ones
  Eigen::MatrixXd
      covariance;  ///< of measured less expected, 3 per landmark, mm²; the measurement's own errors included
};

/// Measured landmarks against their expected places.
struct LandmarkAgreement {
  std::vector<std::string> names;  ///< of the measured ones
  Eigen::VectorXd off_mm;          ///< from the expected place
  Eigen::VectorXd expected_mm;     ///< rms of what off_mm may be: root of the sum of the three variances
  double chi_squared = 0;          ///< eᵀ Σ⁻¹ e over all of them
  int degrees = 0;                 ///< 3 per landmark
  double p_value = 1;
};

/// @throws InputError  a measured landmark that nothing is expected of; a covariance that is not positive
LandmarkAgreement compare_to_expected(const Landmarks& measured, const ExpectedPlaces& expected);

}  // namespace supine::calibration
