// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "segmentation/chest/chest_wall.h"
#include "segmentation/image.h"
#include "segmentation/masks.h"
#include "segmentation/overlay.h"

namespace supine::segmentation {

/// Something about an automatic segmentation that does not look right, and where.
struct Doubt {
  std::string what;          ///< a sentence with value and bound
  Eigen::Vector3d place_mm;  ///< LPS: where to look
};

/// An automatic segmentation and what it was made of.
struct Segmented {
  const GreyImage& image;  ///< as the file has it
  const LabelImage& labels;
  const ChestWall& wall;
  bool fat_suppressed;  ///< what the recipe takes the image for
};

/// What the image itself says against being of the kind the recipe is for.
///
/// The greys of the fat in front of the chest and of the muscle behind it, side by side so that the coil's shading
/// counts little: without suppression fat is brighter by a multiple (T1 of fat 296 and 366 ms, of muscle 1008 and 1412
/// ms at 1.5 and 3 T: Rakow-Penner et al., J. Magn. Reson. Imaging 23, 2006; Stanisz et al., Magn. Reson. Med. 54,
/// 2005), with it they are about as bright.
/// @throws InputError  when it is of another kind: with the greys and what to do
void require_kind(const Segmented& segmented);

/// What is measured of the result: signal outside the skin and none inside, a breast cut off by the image's edge, sides
/// that differ, volumes and shares of gland beyond those of healthy women.
std::vector<Doubt> find_doubts(const Segmented& segmented);

/// The surroundings of a doubt's place, 60 mm to every side: an axial, a sagittal and a coronal slice through it side
/// by side, with the tissues' outlines; the place is in the middle.
std::array<Picture, 3> pictures_of(const Doubt& doubt, const LabelImage& labels, const GreyImage& image);

}  // namespace supine::segmentation
