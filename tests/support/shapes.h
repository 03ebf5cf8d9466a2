// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "meshing/tet_mesh.h"
#include "reconstruction/surface.h"

namespace supine::testing {

/// Box [0, size] of nx × ny × nz cubes, six tetrahedra each, all adipose. Region: z = 0 inner, the rest skin.
/// The muscle sheet is the plane z = 0, 20 mm larger than the box on every side, normals toward +z.
meshing::TetMesh box_mesh(int nx, int ny, int nz, const Eigen::Vector3d& size_mm);

/// A breast-like dome on a muscle: x lateral (of a left breast), y posterior, z head; outward is -y.
/// Over a point of the muscle at arc length s = (lateral, head) from the axis, ρ = |s| / foot_radius_mm, the tissue is
/// rim_thickness + height (1 - ρ²)^1.5 thick inside the foot and rim_thickness outside.
struct DomeOptions {
  double foot_radius_mm = 64;
  double height_mm = 44;  ///< of the mound above the rim's thickness
  double rim_thickness_mm = 12;
  double rim_factor = 1.25;       ///< the inner surface ends here, in foot radii
  double muscle_radius_mm = 145;  ///< of the cylinder (axis along z); 0 = plane
  int rings = 8;                  ///< of triangles from the axis to the rim
  int layers = 3;                 ///< of prisms through the thickness
  int muscle_rings = 30;          ///< of the muscle sheet, which reaches muscle_margin_mm past the rim
  double muscle_margin_mm = 0;
};

/// All adipose; top skin, bottom inner, rim cut. The muscle's surface passes through the origin.
meshing::TetMesh dome_mesh(const DomeOptions& options = {});

/// The closed surface of dome_mesh() without its inside: for the mesher.
reconstruction::Surface dome_surface(const DomeOptions& options = {});

/// The boundary of a mesh as a surface with regions (corner nodes; points that are not on it are dropped).
reconstruction::Surface boundary_surface(const meshing::TetMesh& mesh);

/// A copy at R x + t.
meshing::TetMesh moved(meshing::TetMesh mesh, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& shift_mm);

/// Fills faces, face_cell and region (all skin) of a linear mesh from its points and cells.
void add_boundary(meshing::TetMesh& mesh);

}  // namespace supine::testing
