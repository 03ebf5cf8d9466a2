// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/outliers.h"

#include <algorithm>

#include "calibration/noise.h"
#include "calibration/scan.h"

namespace supine::calibration {

Outliers find_outliers(const Points& place, const SignedDistances& distances, double given_noise_mm) {
  Outliers found;
  std::vector<int> over;
  for (int i = 0; i < place.rows(); ++i)
    if (!distances.closest.on_border[i]) over.push_back(i);
  found.over_skin = static_cast<int>(over.size());
  if (found.over_skin < Scan::least_points) return found;
  const Points near = place(over, Eigen::all);
  const Eigen::VectorXd distance_mm = distances.distance_mm(over);
  found.noise_mm = std::max({estimate_noise_mm(near, distance_mm), given_noise_mm, least_noise_mm});
  for (const int row : points_that_stand_out(near, distance_mm, found.noise_mm))
    found.points.push_back(over[static_cast<std::size_t>(row)]);
  return found;
}

}  // namespace supine::calibration
