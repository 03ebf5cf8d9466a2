// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "segmentation/chest/chest_wall.h"

namespace supine::segmentation {

/// Grey profiles along the rays of a chest wall search, a polar resampling of the image: values[(k angles + a) count +
/// i] lies on ray a of level k at the radius base_mm(a, k) + first_mm + i step_mm.
struct RayProfiles {
  static constexpr double step_mm = 0.75;
  static constexpr double nearest_mm = 30;  ///< to the centre that the wall may come
  static constexpr double shortest_mm = 5;  ///< that a ray must go on beyond nearest_mm to show anything
  Eigen::ArrayXXd base_mm;                  ///< angles by levels
  double first_mm = 0;
  int count = 0;
  std::vector<float> values;
  std::vector<int> end;  ///< per ray: the first sample that lies outside body or image

  Eigen::Index angles() const { return base_mm.rows(); }
  Eigen::Index levels() const { return base_mm.cols(); }
  std::size_t ray(Eigen::Index a, Eigen::Index k) const { return static_cast<std::size_t>(k * angles() + a); }
  double radius_mm(Eigen::Index a, Eigen::Index k, double i) const { return base_mm(a, k) + first_mm + i * step_mm; }
  /// Whether there was anything to see on a ray.
  bool seen(Eigen::Index a, Eigen::Index k) const { return radius_mm(a, k, end[ray(a, k)]) > nearest_mm + shortest_mm; }
};

/// Samples an image along the rays of @p wall, at radii from base + from_mm to base + to_mm. Beyond the body's skin and
/// beyond the image a ray keeps its last value.
RayProfiles sample_rays(const GreyImage& image, const Mask& body, const ChestWall& wall, Eigen::ArrayXXd base_mm,
                        double from_mm, double to_mm);

/// Averages over neighbouring rays and levels (triangular weights reaching `angles` and `levels` to either side).
void blur_profiles(RayProfiles& profiles, int angles, int levels);

}  // namespace supine::segmentation
