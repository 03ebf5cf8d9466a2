// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "common/arrays.h"
#include "reconstruction/surface.h"
#include "segmentation/tissue.h"

namespace supine::meshing {

/// A tagged tetrahedral mesh of everything but the muscle; mm, LPS.
///
/// Nodes per cell: 4 (linear) or 10 (quadratic, VTK order: corners 0-3, then the middles of edges
/// 01 12 02 03 13 23). Boundary faces: 3 or 6 nodes (corners, then the middles of 01 12 20), counter-clockwise
/// seen from outside; together they are the whole boundary.
struct TetMesh {
  Points points;                   ///< #N by 3
  Indices cells;                   ///< #C by 4 or 10; positive volume
  Eigen::VectorXi tissue;          ///< #C, values of segmentation::Tissue: the tissue with the largest fraction
  Table fraction;                  ///< #C by segmentation::tissue_count, rows sum to 1 over the meshed tissues
  Indices faces;                   ///< #F by 3 or 6
  Eigen::VectorXi region;          ///< #F, values of reconstruction::Region, never none
  Eigen::VectorXi face_cell;       ///< #F, the cell the face belongs to
  reconstruction::Surface muscle;  ///< the breast-facing muscle sheet, normals toward the breast; travels with the mesh

  /// What holds the body, by name, and of each triangle of `muscle` the row of its support. Empty: the muscle is the
  /// one support.
  std::vector<std::string> support_names;
  Eigen::VectorXi muscle_support;
  /// Named parts (beside the tissues): the share of each in each cell, #C by #parts; a cell's shares may sum to less
  /// than 1.
  std::vector<std::string> part_names;
  Table part_fraction;

  int order() const { return cells.cols() == 10 ? 2 : 1; }
};

}  // namespace supine::meshing
