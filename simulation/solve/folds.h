// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>

#include "common/arrays.h"

namespace supine::simulation {

/// Quadratic cells of a shape that are inside out somewhere. The energy of such a cell is finite and its equilibrium
/// sound as long as det F > 0 at its quadrature points; between them, mostly at a corner, the map folds back on itself.
struct Folds {
  int cells = 0;
  int worst_cell = -1;  ///< of the most negative determinant
  double worst = 0;     ///< there: smallest det ∂x/∂ξ at a corner, or bound over the cell, over the cell's mean
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();  ///< of that corner
};

/// Finds the cells of a shape that are not proved to be the right way out by the Bernstein bounds of
/// meshing/jacobian.h. Linear cells never fold.
/// @param cells  #C by 4 or 10, VTK node order   @param shape  #N by 3, mm
Folds find_folds(const Indices& cells, const Points& shape);

/// What to tell the user of them; empty where there are none. @param name  of the shape, for example "undeformed"
std::string folds_warning(const std::string& name, const Folds& folds);

}  // namespace supine::simulation
