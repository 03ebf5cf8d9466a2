// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>

#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Smallest and largest dihedral angle of a corner tetrahedron, degrees. Row per corner.
/// An inverted or flat tetrahedron gives {0, 180}.
std::pair<double, double> dihedral_range_deg(const Eigen::Matrix<double, 4, 3>& corners);

/// One number for both ways of being bad: the smaller of the smallest dihedral angle and 1.2 × (180° - the largest
/// one).
double shape_angle_deg(const Eigen::Matrix<double, 4, 3>& corners);

/// 3 × inradius / circumradius: 1 for the regular tetrahedron, 0 for a flat one, negative for an inverted one.
double radius_ratio(const Eigen::Matrix<double, 4, 3>& corners);

/// The health of a mesh, in numbers.
struct QualityReport {
  Eigen::Index nodes = 0, cells = 0, faces = 0;
  Eigen::Index inverted = 0;  ///< cells without positive volume, or turned inside out somewhere
  double min_dihedral_deg = 180, max_dihedral_deg = 0;
  std::array<Eigen::Index, 18> smallest_dihedral{};  ///< cells whose smallest angle lies in [10 i, 10 i + 10) degrees
  std::array<Eigen::Index, 18> largest_dihedral{};   ///< the same of the largest
  int smallest_angle_cell = -1;                      ///< the one with min_dihedral_deg
  Eigen::Vector3d smallest_angle_place_mm = Eigen::Vector3d::Zero();
  double min_radius_ratio = 1, mean_radius_ratio = 0;
  std::array<Eigen::Index, 10> radius_ratio{};               ///< cells with it in [i, i + 1) tenths; <= 0 in the first
  double min_scaled_jacobian = 1, mean_scaled_jacobian = 1;  ///< of quadratic cells, lower bounds (jacobian.h)
  std::array<Eigen::Index, 10> scaled_jacobian{};  ///< quadratic cells with it in [i, i + 1) tenths; <= 0 in the first
  int worst_jacobian_cell = -1;                    ///< -1 in linear meshes
  Eigen::Vector3d worst_jacobian_place_mm = Eigen::Vector3d::Zero();
  int worst_cell = -1;  ///< the one with the smallest radius ratio
  Eigen::Vector3d worst_place_mm = Eigen::Vector3d::Zero();
  double volume_ml = 0;
  Eigen::VectorXd tissue_ml;         ///< by segmentation::Tissue, from the fractions
  std::array<double, 5> area_cm2{};  ///< by reconstruction::Region
  std::array<Eigen::Index, 5> region_faces{};
};

/// Angles and ratios of the corner tetrahedra; volumes, areas and inversion of the cells as they are, curved or not.
/// @param mesh  mesh.fraction may be empty
QualityReport measure_quality(const TetMesh& mesh);

}  // namespace supine::meshing
