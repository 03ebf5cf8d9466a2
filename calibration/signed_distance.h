// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "calibration/model_skin.h"
#include "calibration/scan.h"
#include "calibration/surface_distance.h"

namespace supine::calibration {

/// Signed distances of a batch of points; > 0 where the scan lies outside the model. Reused buffers keep their memory.
struct SignedDistances {
  ClosestPoints closest;
  Eigen::VectorXd distance_mm;  ///< #Q
};

/// Scan → model: each scan point to the closest point of the model's skin.
///
/// d = ±|y − c|, + where y lies on the outer side of the skin at c (pseudo-normal).
/// Points that lie closest to the border of the skin (closest.on_border) are beyond the model and say nothing of it.
///
/// Since c is the closest point, its sliding along the skin does not change d, and
///   ∂d/∂x_a = −w_a u,   ∂d/∂y = u,
/// with w_a = closest.weight at the node a = closest.node, and u the row of @ref direction.
/// @param scan_points  #Q by 3, mm
void scan_to_model(const ModelSkin& model, const Points& scan_points, SignedDistances& result);

/// u = (y − c)/d, #Q by 3, unit; the normal at c where |d| < 1e-9 mm.
Points direction(const Points& scan_points, const SignedDistances& distances);

/// Bounds of "covered": where the scan says how far the model is off.
struct CoverageBounds {
  double distance_mm = 20;  ///< closer than this, > 0
  double angle_deg = 60;    ///< between the normals, in (0, 90]
};

/// Model → scan: distances of points of the model to the scan.
struct ModelToScan {
  SignedDistances to_scan;
  Eigen::Array<bool, Eigen::Dynamic, 1> covered;  ///< #Q
};

/// d = |c − x|, + where the scan point c lies on the outer side of the model at x: sign of n · (c − x).
/// Covered: c is inside the scan (not on an open edge, not past the last points of a cloud), closer than the bound,
/// and the normals are within the angle. The scan's normals are those of its points, weighted to c; the normals of a
/// cloud count in either sense. A contour covers nothing.
/// @param points   #Q by 3, of the model, mm
/// @param normals  #Q by 3, unit, outward
/// @throws InputError  bounds out of range, sizes that differ
void model_to_scan(const Scan& scan, const Points& points, const Points& normals, const CoverageBounds& bounds,
                   ModelToScan& result);

}  // namespace supine::calibration
