// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "calibration/model_skin.h"
#include "calibration/surface_distance.h"
#include "reconstruction/surface.h"

namespace supine::calibration {

/// A measured surface, open and with holes: triangles or bare points, checked and ready for distances.
class Scan {
 public:
  static constexpr int least_points = 100;        ///< of a bare point cloud
  static constexpr int least_triangles = 20;      ///< of a triangulated scan
  static constexpr double least_extent_mm = 3;    ///< diagonal of the bounding box; below, the unit is not mm
  static constexpr double most_extent_mm = 5000;  ///< above, the unit is not mm either

  /// Turns triangles so that each connected piece has one outer side, the side on which most of the model's
  /// outward normals point.
  /// @param surface  triangles, or points without triangles; mm, LPS
  /// @param name     of its file, for messages
  /// @throws InputError  too few points or triangles, not in mm, coordinates not finite
  Scan(const reconstruction::Surface& surface, const ModelSkin& model, const std::string& name = "the scan");

  /// The points that were measured: those of the triangles, or all of a cloud; #P by 3.
  const Points& points() const { return distance_.points(); }
  const SurfaceDistance& distance() const { return distance_; }
  /// As the contour in an image: covers nothing.
  bool is_contour() const { return distance_.is_contour(); }

 private:
  SurfaceDistance distance_;
};

/// Refuses a scan that was written as RAS: diag(−1, −1, 1) brings it from more than 10 mm to less than a third of its
/// distance (two thirds when more than half of its points over the muscle sheet lie behind it).
///
/// Distances are medians, the smaller of scan → skin and skin → scan, so that neither a scan of the whole trunk nor
/// one of a small patch looks far away.
/// @param muscle  breast-facing muscle sheet, normals toward the breast; without triangles it is not looked at
/// @throws InputError  with the distances and what to write
void check_frame(const Scan& scan, const ModelSkin& model, const reconstruction::Surface& muscle,
                 const std::string& name = "the scan");

/// Refuses a scan that does not lie at the body, and says what is wrong with it: as check_frame(), and when it is
/// further than 30 mm, or when more than half of its points over the muscle sheet lie behind it.
/// @param muscle  breast-facing muscle sheet, normals toward the breast; without triangles it is not looked at
/// @throws InputError  with the distances and what to write
void check_placement(const Scan& scan, const ModelSkin& model, const reconstruction::Surface& muscle,
                     const std::string& name = "the scan");

}  // namespace supine::calibration
