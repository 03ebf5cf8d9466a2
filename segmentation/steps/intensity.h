// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/image.h"
#include "segmentation/masks.h"
#include "segmentation/steps/recipe.h"

namespace supine::segmentation {

/// Removes the noise floor in place; see NoiseFloor. @return sigma, in the greys of the image
/// @throws InputError  when no voxel is below air_below
double remove_noise_floor(GreyImage& image, const NoiseFloor& step);

/// What correct_bias found.
struct BiasFit {
  std::size_t voxels = 0;          ///< used in the end
  double residual_sd = 0;          ///< of ln(grey) over them
  double lowest = 1, highest = 1;  ///< range of the shading over those voxels, relative to its geometric mean
};

/// Divides out the shading in place; see Bias.
/// @param within  the mask step.within names; empty = the whole image
/// @throws InputError  when fewer voxels lie in the tissue's range than the polynomial needs (10 per coefficient)
BiasFit correct_bias(GreyImage& image, const Bias& step, const Mask& within = {});

/// Smooths in place; see Smooth.
void smooth(GreyImage& image, const Smooth& step);

}  // namespace supine::segmentation
