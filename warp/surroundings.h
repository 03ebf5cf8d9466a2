// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "calibration/surface_distance.h"
#include "warp/cell_raster.h"

namespace supine::warp {

/// What lies outside a body and goes along with the closest place of its surface.
struct Reach {
  /// Beyond muscle side and cut: the less the further away, by 1 − 3t² + 2t³ of that place's way, t the distance over
  /// this reach, mm.
  double tissue_mm = 10;
  /// Beyond the skin: by 1 − t, or wholly within the reach and not beyond. Where the skin ends the reach is that of
  /// tissue, and grows by twice the distance from there.
  double air_mm = 10;
  bool air_fades = true;
};

/// The surroundings of a body in one shape, and where they lie in another.
class Surroundings {
 public:
  /// @param target, source  as of CellRaster
  Surroundings(const meshing::TetMesh& mesh, const Points& target, const Points& source, const Reach& reach);

  /// Fills the voxels of a slab that are not in the body.
  void fill(const segmentation::Grid& grid, Slab& slab) const;

 private:
  std::vector<std::size_t> near_voxels(const segmentation::Grid& grid, const Slab& slab) const;

  calibration::SurfaceDistance surface_;
  std::vector<bool> is_skin_;  // of its triangles
  Points way_;                 // of the nodes, source − target
  Eigen::VectorXd air_mm_;     // of the nodes, reach over the skin there
  Reach reach_;
};

}  // namespace supine::warp
