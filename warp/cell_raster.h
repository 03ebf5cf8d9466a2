// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "meshing/tet_mesh.h"
#include "segmentation/image.h"

namespace supine::warp {

/// Where a voxel lies: off the body, beside it, so close that it shows the body's own edge, in it.
enum class Place : std::uint8_t { elsewhere, beside, edge, body };

/// Some slices of a grid: for every voxel the way from it to where it comes from. Voxels in the order of the grid.
struct Slab {
  int first = 0, count = 0;         ///< slices k
  std::vector<Eigen::Vector3f> mm;  ///< source place − target place, LPS
  std::vector<Place> place;

  /// Slices [from, from + slices) of a grid, nothing filled.
  void start(const segmentation::Grid& grid, int from, int slices);
};

/// Voxels that two cells claim: the body lies in itself there.
struct Overlap {
  std::size_t voxels = 0;
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();  ///< of the first of them

  void add(const Overlap& other);
};

/// The cells of a body in one shape on the voxels of a grid, and where they lie in another shape. Exact: linear cells
/// by their barycentric coordinates, quadratic ones by Newton's method on the curved map.
class CellRaster {
 public:
  /// @param target  #N by 3, mm: the shape the grid shows
  /// @param source  #N by 3, mm: the shape its voxels come from
  /// @pre  mesh outlives the object
  CellRaster(const meshing::TetMesh& mesh, const Points& target, const Points& source, const segmentation::Grid& grid);

  /// Fills what lies in the body and leaves the rest of the slab as it is. Runs on the OpenMP threads; of several cells
  /// the first one counts.
  Overlap fill(Slab& slab) const;

  /// 1 where the centre of a voxel lies in the body, in the order of the grid.
  std::vector<std::uint8_t> mask() const;

 private:
  void fill_slice(int k, Slab& slab, std::vector<float>& depth, Overlap& overlap) const;
  template <class Found>
  void visit_linear(int cell, int k, Found found) const;
  template <class Found>
  void visit_quadratic(int cell, int k, Found found) const;

  const meshing::TetMesh& mesh_;
  const Points& target_;
  segmentation::Grid grid_;
  Points index_;                            // target in continuous indices of the grid; control points of curved cells
  Points way_;                              // source − target
  std::vector<std::vector<int>> by_slice_;  // cells that may meet a slice
};

}  // namespace supine::warp
