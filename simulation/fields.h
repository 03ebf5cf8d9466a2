// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "common/arrays.h"
#include "simulation/effect.h"

namespace supine::meshing {
struct Anatomy;
struct TetMesh;
}  // namespace supine::meshing

namespace supine::simulation {

/// Standard gravity in mm/s².
inline constexpr double gravity_mm_s2 = 9810.0;

/// Material and loads of the mechanical terms on one mesh, for one pose. Effects change these and nothing else.
/// T = double for solving, Dual for the derivative with respect to one parameter.
template <class T>
struct Fields {
  using Column = Eigen::Matrix<T, Eigen::Dynamic, 1>;

  Column ln_young;       ///< #cells; ln of Young's modulus in kPa
  Column poisson;        ///< #cells; 0 to 0.5 exclusive
  Column stiffening;     ///< #cells; b of the exponential law, >= 0
  Column law_shape_1;    ///< #cells; mooney_rivlin: share of C01, yeoh: C2/C1, gent: limit Jm; 0 for other laws
  Column law_shape_2;    ///< #cells; yeoh: C3/C1; 0 for other laws
  Column fibre_modulus;  ///< #cells; k_f in kPa of fibres along the muscle's outward normal, >= 0
  Column density;        ///< #cells; kg/mm³

  Column skin_modulus;      ///< #skin faces; Young's modulus × thickness, kPa mm
  Column skin_poisson;      ///< #skin faces; corotational law only
  Column skin_compression;  ///< #skin faces; share of the full energy kept where the skin wrinkles
  Column skin_prestretch;   ///< #skin faces; stretch already there in the undeformed shape, 1 = none
  Column skin_stiffening;   ///< #skin faces; b of the exponential law, >= 0
  Column skin_bending;      ///< #skin faces; bending stiffness over skin_modulus, mm²
  Column skin_traction;     ///< 3 per skin face, xyz; dead load per undeformed area, kPa

  Column interface_normal;      ///< #interface points; kPa/mm
  Column interface_tangential;  ///< #interface points; kPa/mm
  Column interface_friction;    ///< #interface points; Coulomb's coefficient
  Column muscle_offset;         ///< #interface points; mm the muscle has come out along its normal in this pose
  Column cut_stiffness;         ///< #cut points; kPa/mm

  Column gravity;        ///< 3; mm/s², in the pose
  Column imaged_offset;  ///< 3 per node, xyz; mm from the imaged nodes as given to where the true ones are
  Column scan_motion;    ///< 6; translation in mm, then rotation vector in rad, of the scan about its centroid
};

template <class T>
struct FieldColumn {
  const char* name;
  typename Fields<T>::Column Fields<T>::*column;
};

/// Every column, for what treats them alike.
template <class T>
inline constexpr FieldColumn<T> field_columns[] = {{"ln_young", &Fields<T>::ln_young},
                                                   {"poisson", &Fields<T>::poisson},
                                                   {"stiffening", &Fields<T>::stiffening},
                                                   {"law_shape_1", &Fields<T>::law_shape_1},
                                                   {"law_shape_2", &Fields<T>::law_shape_2},
                                                   {"fibre_modulus", &Fields<T>::fibre_modulus},
                                                   {"density", &Fields<T>::density},
                                                   {"skin_modulus", &Fields<T>::skin_modulus},
                                                   {"skin_poisson", &Fields<T>::skin_poisson},
                                                   {"skin_compression", &Fields<T>::skin_compression},
                                                   {"skin_prestretch", &Fields<T>::skin_prestretch},
                                                   {"skin_stiffening", &Fields<T>::skin_stiffening},
                                                   {"skin_bending", &Fields<T>::skin_bending},
                                                   {"skin_traction", &Fields<T>::skin_traction},
                                                   {"interface_normal", &Fields<T>::interface_normal},
                                                   {"interface_tangential", &Fields<T>::interface_tangential},
                                                   {"interface_friction", &Fields<T>::interface_friction},
                                                   {"muscle_offset", &Fields<T>::muscle_offset},
                                                   {"cut_stiffness", &Fields<T>::cut_stiffness},
                                                   {"gravity", &Fields<T>::gravity},
                                                   {"imaged_offset", &Fields<T>::imaged_offset},
                                                   {"scan_motion", &Fields<T>::scan_motion}};

/// Where the fields live: for each group of faces of the mesh, its faces and its quadrature points.
struct FaceGroup {
  Eigen::VectorXi faces;     ///< rows of TetMesh::faces
  Table q;                   ///< #points by 2, anatomy coordinates; points of one face follow each other
  Eigen::VectorXd area_mm2;  ///< #points; imaged area each point stands for
  Eigen::VectorXi breast;    ///< #points; row of Anatomy::breasts, 0 where there is one breast only
};

class SkinOffsetOnce;

struct Layout {
  FaceGroup skin;                  ///< one point per face: its centroid
  FaceGroup interface;             ///< inner and ligament regions, quadrature points; faces of one support together
  std::vector<int> support_begin;  ///< #supports + 1; the first of each support's faces in interface.faces, and the end
  FaceGroup cut;                   ///< quadrature points
  Table cell_q;                    ///< #cells by 2, anatomy coordinates of cell centroids
  Eigen::VectorXi cell_breast;     ///< #cells; row of Anatomy::breasts, 0 where there is one breast only

  /// skin_offset() of the scene's mesh, which must be the layout's own; found when first asked for, then kept. Threads
  /// may ask at the same time.
  const Eigen::VectorXd& unit_skin_offset(const Scene& scene) const;
  std::shared_ptr<SkinOffsetOnce> skin_offset_once;
};

Layout make_layout(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy);  ///< InputError: of another mesh

/// The numbers without their derivatives, and the derivatives alone.
Fields<double> values_of(const Fields<Dual>& fields);
Fields<double> derivatives_of(const Fields<Dual>& fields);

}  // namespace supine::simulation
