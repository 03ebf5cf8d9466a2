// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>

#include "meshing/tet_mesh.h"
#include "segmentation/image.h"
#include "warp/cell_raster.h"
#include "warp/sampler.h"

namespace supine::warp {

/// One body in two shapes; sizes #N by 3, mm.
struct TwoShapes {
  const meshing::TetMesh& mesh;
  const Points& source;  ///< the shape that the volume shows
  const Points& target;  ///< the shape it is carried into
};

struct WarpOptions {
  Interpolation interpolation = Interpolation::linear;
  double blend_mm = 10;  ///< over it the tissue beside the body passes into what stays; so far the air goes along
  std::optional<float> background;       ///< value of what the volume does not show; none = its least value
  std::function<void(double)> progress;  ///< share done; may be empty
};

struct WarpedVolume {
  segmentation::GreyImage image;
  std::size_t body_voxels = 0;    ///< centres in the target shape
  std::size_t unseen_voxels = 0;  ///< of them, those that come from beyond the volume
  std::size_t left_voxels = 0;    ///< where the body has left in the source shape and nothing came: background
  Overlap overlap;
};

/// A volume carried from one shape into the other. Inside the body exact; outside it stays, blended over blend_mm.
/// Where it would show the body at the place it has left, there is background.
/// @param grid  of the result
WarpedVolume warp_volume(const TwoShapes& shapes, const segmentation::GreyImage& volume, const segmentation::Grid& grid,
                         const WarpOptions& options);

/// The lattice of @p grid, grown by whole voxels until it holds all of @p shape and @p margin_mm beyond.
segmentation::Grid grown_to_hold(const segmentation::Grid& grid, const Points& shape, double margin_mm);

/// The same box with other spacing. @param spacing_mm  > 0
segmentation::Grid with_spacing(const segmentation::Grid& grid, const Eigen::Vector3d& spacing_mm);

/// Refuses a grid that does not fit into memory. @param bytes_per_voxel  all that is kept at the same time
/// @throws InputError  naming what is needed, what is there, and the spacing that would do
void check_memory(const segmentation::Grid& grid, double bytes_per_voxel);

/// How much darker than the body the volume is outside its skin: chance that a place 3 mm outside the skin is darker
/// than the one 3 mm inside. 0.5 where the volume shows another body; about 1 where it shows this one in air.
double skin_contrast(const meshing::TetMesh& mesh, const Points& shape, const segmentation::GreyImage& volume);

}  // namespace supine::warp
