// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "common/arrays.h"
#include "meshing/tet_mesh.h"
#include "simulation/model.h"

namespace supine::testing {

/// A finite deformation x = φ(X) of the cube [0, size]³ with everything that follows from it for a law: F, P and the
/// dead body force b = -Div P that keeps it in equilibrium. F and Div P come from φ and P(F) by automatic
/// differentiation; the engine's own stresses are not used. φ is the identity on the face z = 0; it twists the opposite
/// face by 46 degrees and stretches the cube by a third and more.
class ManufacturedProblem {
 public:
  struct Point {
    Eigen::Matrix3d f, stress;   ///< ∂x/∂X; first Piola-Kirchhoff, kPa
    Eigen::Vector3d body_force;  ///< mN/mm³ of undeformed volume
  };

  ManufacturedProblem(simulation::BulkLaw law, double size_mm, double young_kpa, double poisson);

  Eigen::Vector3d map(const Eigen::Vector3d& X) const;
  Eigen::Matrix3d gradient(const Eigen::Vector3d& X) const;
  /// @throws std::invalid_argument  a law whose stress is not written here
  Point at(const Eigen::Vector3d& X) const;

  /// Nodal forces of the body force and of the tractions P N on all faces but z = 0, mN, dof 3 node + axis.
  /// Straight-sided cells, linear or quadratic.
  Eigen::VectorXd external_forces(const meshing::TetMesh& mesh) const;

  struct Errors {
    double l2;  ///< √∫|x_h - x|² dV, mm^2.5
    double h1;  ///< √∫‖F_h - F‖² dV, mm^1.5
  };
  Errors errors(const meshing::TetMesh& mesh, const Points& x) const;

 private:
  simulation::BulkLaw law_;
  double size_mm_, mu_kpa_, lambda_kpa_;
};

}  // namespace supine::testing
