// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/surface_distance.h"
#include "registration/rigid_transform.h"

namespace supine::registration {

/// A named point, where the scanner saw it and where the body has it.
struct Landmark {
  std::string name;
  Eigen::Vector3d scan;          ///< frame of the scan, mm
  Eigen::Vector3d image;         ///< frame of the image, in the pose, mm
  Eigen::Vector3d displacement;  ///< imaged pose → this pose, as predicted, mm; 0 when rigid
  double sigma_mm = 1;           ///< of its picking, along every axis
  bool rigid = false;            ///< bone: where the image has it, whatever the model says
};

/// What a scan is laid on. One of the two surfaces, or landmarks, at least.
struct Target {
  const calibration::SurfaceDistance* skin = nullptr;   ///< predicted in the pose; deforms, so it may be wrong
  Points skin_displacement;                             ///< of skin's points, imaged pose → this pose, mm; or empty
  const calibration::SurfaceDistance* rigid = nullptr;  ///< does not deform
};

/// A scan in its own frame and the body it shows.
struct Problem {
  Target target;
  Points points;   ///< #P by 3, frame of the scan, mm
  Points normals;  ///< #P by 3, unit, either sense; zero: not known
  std::vector<Landmark> landmarks;
  double noise_mm = 0.7;                     ///< of the scanner along the normal, 1 sigma, > 0
  std::optional<double> independent_points;  ///< that the scan is worth, where several points say the same; none: all
  double rigid_sigma_mm = 0.3;               ///< of the imaged place of what is rigid, 1 sigma, ≥ 0
};

}  // namespace supine::registration
