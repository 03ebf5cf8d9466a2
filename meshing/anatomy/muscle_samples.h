// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "common/arrays.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

/// Evenly spread samples of a sheet: area-weighted means over cubes of about equal area.
struct SheetSamples {
  Points points;             ///< #S by 3, mm
  Points normals;            ///< #S by 3, unit, averaged over about smooth_mm
  Eigen::VectorXd area_mm2;  ///< #S; the sum is the sheet's area
};

/// @param spacing_mm  edge of the cubes
/// @param smooth_mm   standard deviation of the Gaussian that averages the normals
SheetSamples sample_sheet(const reconstruction::Surface& sheet, double spacing_mm, double smooth_mm);

/// Samples of the signed distance beside the sheet.
struct DistanceSamples {
  Points points;
  Eigen::VectorXd distance_mm;
  Eigen::VectorXd weight;  ///< mm², area times the weight of the offset
};

/// φ = 0 on the samples and φ = d at p + d n for ten offsets d, where no other sample is nearer than p.
/// @param highest_mm  largest offset on the breast's side
DistanceSamples offset_samples(const SheetSamples& sheet, double highest_mm);

}  // namespace supine::meshing
