// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "meshing/anatomy/chest_beside.h"
#include "meshing/tet_mesh.h"
#include "simulation/model.h"

namespace supine::simulation {

/// Skin that lies inside the body elsewhere: two parts of it stand in one place.
struct Overlap {
  int samples = 0;                                     ///< of the skin (terms/skin_samples.h) that lie inside
  double deepest_mm = 0;                               ///< furthest behind the skin they came through
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();  ///< there
};

/// Asks every sample of the skin whether a cell that is no neighbour of its face holds it; quadratic cells as their
/// corners span them. Knows nothing of contact, so that it judges poses solved with and without.
/// @param skin   faces of the skin, #F by 3 or 6   @param shape  #N by 3, mm
Overlap find_overlap(const meshing::TetMesh& mesh, const Indices& skin, const Points& shape);

/// The same of the chest beside the breast: nodes of the skin that lie in it, where it is there in full.
Overlap find_in_chest(const meshing::ChestBeside& chest, const Indices& skin, const Points& shape);

/// What to tell the user of it; empty where it is not deeper than a scan shows. @param name  of the shape
std::string in_chest_warning(const std::string& name, const Overlap& overlap, const ContactSettings& settings);

/// What to tell the user of overlapping skin; empty where it is within the band. @param name  of the shape, for example
/// "supine"
/// @param folded_cells  of the shape (folds.h): beside them the depth cannot be trusted, and the text says so
std::string overlap_warning(const std::string& name, const Overlap& overlap, const ContactSettings& settings,
                            int folded_cells = 0);

}  // namespace supine::simulation
