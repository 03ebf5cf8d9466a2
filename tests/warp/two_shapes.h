// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>

#include "warp/warp_volume.h"

namespace supine::warp::testing {

/// A box of 40 mm, [0, 40]³, moved by a map.
struct MovedBox {
  meshing::TetMesh mesh;
  Points target;
  TwoShapes shapes() const { return {mesh, mesh.points, target}; }
  TwoShapes back() const { return {mesh, target, mesh.points}; }
};

using Map = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

MovedBox moved_box(int order, const Map& map);

/// x → A x + t, a turn, a stretch and a shift; and its inverse.
Eigen::Vector3d affine(const Eigen::Vector3d& x);
Eigen::Vector3d affine_back(const Eigen::Vector3d& x);
/// A map that quadratic cells hold exactly.
Eigen::Vector3d bent(const Eigen::Vector3d& x);

/// A volume with the value f at every voxel.
segmentation::GreyImage volume_of(const segmentation::Grid& grid,
                                  const std::function<double(const Eigen::Vector3d&)>& f);

/// @param low  centre of the first voxel   @param length_mm  along each axis   @return  turned about a skew axis
segmentation::Grid grid_over(const Eigen::Vector3d& low, double length_mm, double spacing_mm);

}  // namespace supine::warp::testing
