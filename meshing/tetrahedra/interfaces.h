// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "meshing/tet_mesh.h"
#include "reconstruction/surface.h"
#include "segmentation/tissue.h"

namespace supine::meshing {

/// The border of a tissue inside the body, which no tetrahedron is to cross.
struct Interface {
  reconstruction::Surface surface;  ///< closed, outward; one piece or several
  segmentation::Tissue tissue;      ///< what it encloses; a meshed tissue
  std::string what;                 ///< names it in messages, for example its file
};

/// The body's triangles, then those of the interfaces in their order; points likewise.
/// @throws InputError  an interface that is not sound, of a tissue that is not meshed, that leaves the body, or that
///   crosses or touches the body's surface or another interface; which, and the first place in mm
reconstruction::Surface with_interfaces(const reconstruction::Surface& body, const std::vector<Interface>& interfaces,
                                        const std::string& what);

/// For each cell the number of the interface around it, −1 where there is none; where one lies in another, the one
/// given last.
/// @param walls  the interfaces' triangles by points of @p mesh
Eigen::VectorXi enclosing_interfaces(const TetMesh& mesh, const Triangles& walls,
                                     const std::vector<Interface>& interfaces);

/// Makes tissue and fraction agree with the interfaces: cells inside one are of its tissue alone, cells outside have
/// none of it (their other shares grow; a cell without any is adipose).
/// @param enclosing  from enclosing_interfaces; @pre  mesh.tissue and mesh.fraction are filled in
void impose_interfaces(TetMesh& mesh, const Eigen::VectorXi& enclosing, const std::vector<Interface>& interfaces);

}  // namespace supine::meshing
