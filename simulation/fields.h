// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "common/arrays.h"
#include "simulation/catalogue.h"
#include "simulation/model.h"

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

  Column ln_young;    ///< #cells; ln of Young's modulus in kPa
  Column poisson;     ///< #cells; 0 to 0.5 exclusive
  Column stiffening;  ///< #cells; b of the exponential law, >= 0

  Column skin_modulus;     ///< #skin faces; Young's modulus × thickness, kPa mm
  Column skin_prestretch;  ///< #skin faces; stretch already there in the undeformed shape, 1 = none

  Column interface_normal;      ///< #interface points; kPa/mm
  Column interface_tangential;  ///< #interface points; kPa/mm
  Column cut_stiffness;         ///< #cut points; kPa/mm

  Eigen::Matrix<T, 3, 1> gravity;  ///< mm/s², in the pose
  T density;                       ///< kg/mm³
};

/// Where the fields live: for each group of faces of the mesh, its faces and its quadrature points.
struct FaceGroup {
  Eigen::VectorXi faces;     ///< rows of TetMesh::faces
  Table q;                   ///< #points by 2, anatomy coordinates; points of one face follow each other
  Eigen::VectorXd area_mm2;  ///< #points; imaged area each point stands for
};

struct Layout {
  FaceGroup skin;       ///< one point per face: its centroid
  FaceGroup interface;  ///< inner and ligament regions, quadrature points
  FaceGroup cut;        ///< quadrature points
  Table cell_q;         ///< #cells by 2, anatomy coordinates of cell centroids
};

Layout make_layout(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy);

/// The fields of @p model in one pose: base model first, then its effects in the order of the catalogue, whatever
/// their order in the model.
/// @param gravity  unit vector of the pose
/// @throws InputError  an effect that is not in the catalogue
Fields<Dual> make_fields(const Model& model, const Scene& scene, const Eigen::Vector3d& gravity);

/// Refuses effects that can change nothing here, so that nobody waits for them: no tissue of that kind, no interface
/// point in the ring, a law or a boundary that does not read the field.
/// @throws InputError  naming the effect and the reason
void check_effects_act(const Model& model, const Scene& scene);

/// The numbers without their derivatives.
Fields<double> values_of(const Fields<Dual>& fields);

}  // namespace supine::simulation
