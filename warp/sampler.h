// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "segmentation/image.h"

namespace supine::warp {

enum class Interpolation { nearest, linear, bspline };

/// Values of a volume between its voxels.
class Sampler {
 public:
  /// @param volume  must outlive the object. For bspline (cubic, through the voxels; Unser 1999, mirrored at the ends)
  ///   a second volume of coefficients is made.
  Sampler(const segmentation::GreyImage& volume, Interpolation interpolation);

  /// At a continuous index; nothing further than half a voxel beyond the outermost centres.
  std::optional<float> at(const Eigen::Vector3d& index) const;

 private:
  float nearest(const Eigen::Vector3d& index) const;
  float linear(const Eigen::Vector3d& index) const;
  float cubic(const Eigen::Vector3d& index) const;

  const segmentation::GreyImage& volume_;
  Interpolation interpolation_;
  std::vector<float> coefficients_;
};

}  // namespace supine::warp
