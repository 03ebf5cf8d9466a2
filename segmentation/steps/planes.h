// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "segmentation/chest/chest_wall.h"
#include "segmentation/steps/recipe.h"

namespace supine::segmentation {

/// A cut plane as it was used.
struct CutPlane {
  std::string name;  ///< sternum, mid_axillary, inframammary_left, inframammary_right, superior
  char axis;         ///< x, y or z: the plane is axis = at_mm in patient LPS
  double at_mm;
  bool given;  ///< by the user, rather than found
};

/// Places the planes of a model.
///
/// sternum: the middle line of the torso. mid_axillary: where the chest is widest, which is half way between its front
/// and its back: the median over levels and sides of the depth at which the wall reaches 99 % of its half width.
/// inframammary, one for each side: the lowest level at which the tissue in front of the chest wall is deeper than over
/// the belly by 15 % of the mound's full depth. superior: the uppermost level of the image, less one voxel.
/// That is Planes::Ends::anatomy; with reader mid_axillary is half_turn_y_mm, and both folds are the lower one less 10
/// mm.
std::vector<CutPlane> find_planes(const FrontSkin& front, const ChestWall& wall, const Planes& step);

/// The depth y at which the front of the chest has turned half way (45 degrees) to the side: the median over levels and
/// sides. The middle of the rays where the image shows no such turn.
double half_turn_y_mm(const ChestWall& wall);

/// The masks of the model and of the two sides.
struct PlaneMasks {
  Mask model, left, right;
};
PlaneMasks cut_by_planes(const Mask& body, const Grid& grid, const ChestWall& wall, const std::vector<CutPlane>& planes,
                         Planes::Side side);

}  // namespace supine::segmentation
