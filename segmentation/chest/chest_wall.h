// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "segmentation/chest/superellipse.h"
#include "segmentation/chest/torso.h"
#include "segmentation/masks.h"

namespace supine::segmentation {

/// How the front of the chest wall and the pectoral muscle is looked for.
struct ChestWallOptions {
  /// step: the border parts dark muscle from bright fat (T1). line: fat and muscle may be equally bright, and a thin
  /// dark line (fascia, chemical shift) runs between them (fat-suppressed).
  enum class Border { step, line } border = Border::step;
  float dark = 40;                 ///< greys up to here are surely muscle or chest
  float bright = 65;               ///< greys from here on are surely fat; > dark
  double band_mm = 6;              ///< depth on either side of the border that must be dark and bright; > 0
  double centre_depth_mm = 90;     ///< of the rays' centre behind the skin over the sternum; > 0
  double stiffness_per_mm = 0.03;  ///< cost of a step of the border between neighbouring rays (1 = a wholly wrong band)
  double coupling_per_mm = 0.012;  ///< cost of a step between neighbouring levels
  double far_weight = 0.4;         ///< cost of 10 mm of dark tissue farther out: the border is the outermost
  double oval_pull_per_mm = 0.005;  ///< cost of a distance from the superellipse, as far as 25 mm; >= 0
  double ahead_mm = 12;             ///< the wall comes so far in front of the skin over the sternum; >= 0
  double ahead_cost_per_mm = 0.1;   ///< beyond that: dense gland may look like muscle, but hangs in front
  double refine_mm = 3;             ///< at most this far the border then moves to the half-way grey
};

/// The front of the chest wall as a surface over rays: at every level z, rays leave a centre inside the chest at angles
/// from straight forward, and the wall is at one radius on each.
struct ChestWall {
  Torso torso;
  Superellipse superellipse;  ///< the rough shape that was found first
  double centre_y_mm = 0;
  double z0_mm = 0, step_z_mm = 1;
  double first_angle_rad = 0, step_angle_rad = 0;                    ///< 0 = to the front, > 0 = to the patient's left
  ChestWallOptions::Border border = ChestWallOptions::Border::step;  ///< how it was looked for
  Eigen::ArrayXXd radius_mm;                                         ///< angles by levels
  Eigen::ArrayXXd cost;  ///< of the data there, 0 (clear border) to about 2; NaN where no data decided

  double angle(Eigen::Index a) const { return first_angle_rad + static_cast<double>(a) * step_angle_rad; }
  double z(Eigen::Index k) const { return z0_mm + static_cast<double>(k) * step_z_mm; }
  /// Where the rays of a level start, and the way they go.
  Eigen::Vector3d centre(Eigen::Index k) const { return {torso.sternum_x(z(k)), centre_y_mm, z(k)}; }
  Eigen::Vector3d direction(Eigen::Index a) const { return {std::sin(angle(a)), -std::cos(angle(a)), 0}; }
  Eigen::Vector3d point(Eigen::Index a, Eigen::Index k) const;
  /// How far inside the wall a patient point lies, along its ray; < 0 in front of it. Bilinear between the rays.
  double depth_mm(const Eigen::Vector3d& point) const;
};

/// Finds the border between muscle and fat as the cheapest smooth sheet over all rays (cheapest_surface; costs in
/// ChestWallOptions). Border::step: then moved to the half-way grey, to a fraction of a voxel. Border::line: looked for
/// twice more near to what is known, first as one sheet that fits both sides of the chest.
/// @param image  fat 100
/// @throws InputError  options out of range; the rays' centre outside the image
ChestWall find_chest_wall(const GreyImage& image, const Mask& body, const Torso& torso,
                          const ChestWallOptions& options);

}  // namespace supine::segmentation
