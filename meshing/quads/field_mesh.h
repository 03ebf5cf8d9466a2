// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// The triangles that fields live on: finer than the mesh to be made, coarser than the input.
struct FieldMesh {
  reconstruction::Surface surface;
  Points normals;            ///< unit, of the input's triangles that each point stands for
  Eigen::VectorXd size_mm;   ///< edge length wanted there, by point
  std::vector<char> corner;  ///< 1 for points that must stay: ends and sharp turns of region borders and open borders
};

/// Area-weighted normals of a surface, wanted edge lengths as given.
FieldMesh field_mesh(const reconstruction::Surface& surface, const Eigen::VectorXd& size_mm);

/// Collapses edges shorter than @p share of the size wanted there and splits those longer than twice that. Topology,
/// region borders and open borders stay; points left are points of the input, or lie on its edges.
/// @param share  > 0; about 0.25 gives fields their resolution
FieldMesh adapt(const FieldMesh& from, double share);

}  // namespace supine::meshing
