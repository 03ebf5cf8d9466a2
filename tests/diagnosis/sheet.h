// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <random>

#include "calibration/residuals.h"

namespace supine::testing {

/// Points on a sheet, white noise of 0.5 mm.
inline calibration::Residuals sheet(unsigned seed, int count = 600) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-60, 60);
  std::normal_distribution<double> normal(0, 0.5);
  calibration::Residuals r;
  r.place.resize(count, 3);
  r.distance_mm.resize(count);
  for (int i = 0; i < count; ++i) {
    r.place.row(i) << uniform(generator), uniform(generator), 0;
    r.distance_mm[i] = normal(generator);
  }
  r.on_skin = r.place;
  r.q = r.place.leftCols<2>() / 60;
  r.sigma_mm = Eigen::VectorXd::Constant(count, 0.5);
  r.pose = Eigen::VectorXi::Zero(count);
  r.point = Eigen::VectorXi::LinSpaced(count, 0, count - 1);
  return r;
}

}  // namespace supine::testing
