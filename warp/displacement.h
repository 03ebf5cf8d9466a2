// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "segmentation/formats/vector_io.h"
#include "warp/warp_volume.h"

namespace supine::warp {

/// The way target place → source place on a grid, mm, LPS: in the body that of the model, beside it a continuation that
/// can be turned round.
///
/// Tissue beyond muscle side and cut stays from blend_mm on. The air beside the skin goes along much further, over
/// three times the longest way, because programs move points by the inverse of such a file and search it: air that
/// stayed where the body was would map to the same place as the body. Over the last margin_mm the grid runs out to
/// zero.
struct Displacement {
  segmentation::VectorImage image;
  /// Of linear interpolation between the grid's points, over the middles of the body's cells.
  double error_rms_mm = 0, error_max_mm = 0;
};

/// @param spacing_mm  of the grid, > 0; its axes are those of LPS. It holds both shapes and margin_mm beyond.
Displacement displacement_of(const TwoShapes& shapes, double spacing_mm, double blend_mm);

/// Spacing with which the grid of displacement_of() has about @p points points, not under 1 mm.
double spacing_for(const TwoShapes& shapes, double points);

/// Writes an ITK transform file (text, DisplacementFieldTransform_double_3_3, LPS, mm) that maps a place of the target
/// shape to the place of the source shape: ITK resamples a source volume with it into the target shape, and 3D Slicer
/// moves what is put under it from the source shape into the target shape.
/// @throws InputError  when the file cannot be written
void write_tfm(const segmentation::VectorImage& displacement, const std::filesystem::path& file);

}  // namespace supine::warp
