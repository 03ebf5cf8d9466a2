// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include "meshing/tet_mesh.h"
#include "meshing/tetrahedra/interfaces.h"
#include "meshing/tetrahedra/size_field.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

struct TetrahedraliseOptions {
  std::size_t cells = 0;         ///< about so many tetrahedra; 0 = as the surface's triangles suggest
  double edge_mm = 0;            ///< edges aimed at inside, >= 0; 0 = the surface's mean edge
  double radius_edge = 1.35;     ///< circumradius over shortest edge of a tetrahedron aimed at, in [1.2, 3]
  double min_dihedral_deg = 14;  ///< aimed at, in [0, 18]
  void check() const;            ///< @throws InputError naming option, value and bound
};

/// Fills a closed surface with tetrahedra (TetGen). The surface's triangles stay exactly as they are and become the
/// mesh's faces, each with its region; inner closed pieces of surface are cavities and stay empty.
/// @param surface  closed, manifold, outward, with regions inner, skin, cut (ligament) on every triangle
/// @param what     names the surface in messages, for example its file
/// @return linear mesh; tissue and fraction are not filled in (assign_tissue does), muscle is empty
/// @throws InputError        not closed, not manifold, self-intersecting, inside out: kind, count and first place in mm
/// @throws NumericalFailure  TetGen gave up; what it said
TetMesh tetrahedralise(const reconstruction::Surface& surface, const TetrahedraliseOptions& options,
                       const std::string& what = "the surface");

/// What else tetrahedra are to follow.
struct Inside {
  std::vector<Interface> interfaces;  ///< no tetrahedron crosses them
  const SizeField* sizes = nullptr;   ///< edge lengths; scaled until the number of cells is options.cells
};

struct FilledMesh {
  TetMesh mesh;
  Eigen::VectorXi enclosing;  ///< by cell: the interface around it (enclosing_interfaces), or −1
};

/// The same with interfaces inside and edge lengths that change from place to place.
/// @throws InputError  also with_interfaces
FilledMesh tetrahedralise(const reconstruction::Surface& surface, const Inside& inside,
                          const TetrahedraliseOptions& options, const std::string& what = "the surface");

/// Edge length of the tetrahedra that fit a surface: its triangles' mean edge, mm.
double mean_edge_mm(const reconstruction::Surface& surface);

}  // namespace supine::meshing
