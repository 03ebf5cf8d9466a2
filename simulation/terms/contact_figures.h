// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace supine::simulation {

/// What contact leaves alone because it overlaps, or lies within the band, in a shape that must be free of force.
struct LeftOut {
  int pairs = 0;                                       ///< of faces of the skin; against the chest, faces
  double deepest_mm = 0;                               ///< the smallest gap, negative where they overlap
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();  ///< there
};

/// What touches in one shape.
struct ContactFigures {
  double area_cm2 = 0;      ///< of the skin that is pressed upon (skin on skin: both sides counted), in that shape
  double pressure_kpa = 0;  ///< greatest, over the shape's area
  double overlap_mm = 0;    ///< deepest; 0 where the skin keeps off
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();  ///< of the deepest
  Eigen::VectorXd face_kpa;                            ///< #skin faces, mean over the face
};

}  // namespace supine::simulation
