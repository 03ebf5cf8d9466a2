// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/solve/chain.h"

namespace supine::simulation {

/// Programs that a model can be written for.
enum class Solver { calculix, febio, sofa };

/// Young's modulus and Poisson's ratio.
struct Elastic {
  double young_kpa = 0, poisson = 0;
  bool operator==(const Elastic&) const = default;
};

/// A linear spring between a point of a face and the ground: energy ½ k (d·u - rest)², u = Σ weight_a u_a measured from
/// the undeformed shape.
struct FaceSpring {
  std::array<int, 3> nodes;
  Eigen::Vector3d weight;     ///< shape functions, sum 1
  Eigen::Vector3d direction;  ///< d, unit
  double stiffness = 0;       ///< k, mN/mm
  double rest_mm = 0;
};

/// One pose of a model in words that other solvers have: tetrahedra, springs on faces, dead forces, held nodes.
///
/// Skin. A membrane triangle of thickness h is one tetrahedron more: over the triangle stands an apex of its own, 3 h
/// high, so that the volume is area × h. Nothing else hangs on the apex: in equilibrium it takes the place that frees
/// the tetrahedron of all stress but the triangle's own. That is plane stress, hence the membrane, exactly
/// (corotational), or as closely as the material is incompressible (neo_hookean).
///
/// Interface. The muscle is curved and springs are straight: each spring stands on the plane that touches the muscle
/// under the place where our answer has its point. At our answer force and energy are the curved muscle's; another
/// answer, δ mm away, would feel a muscle wrong by δ²/2 times its curvature.
struct ExportedPose {
  std::string name;
  BulkLaw law = BulkLaw::neo_hookean;
  SkinLaw skin_law = SkinLaw::neo_hookean;
  int nodes = 0;             ///< of the mesh; apexes follow
  Points X;                  ///< undeformed, mm
  Points answer;             ///< #nodes; where our solver puts them in the pose, mm
  Indices cells;             ///< #C by 4
  Eigen::VectorXi material;  ///< #C, row of materials
  std::vector<Elastic> materials;
  Indices skin;           ///< #skin faces by 4: the face, seen counter-clockwise from outside, and its apex
  Elastic skin_material;  ///< poisson of skin_law corotational only
  std::vector<FaceSpring> springs;
  Points force;           ///< #nodes by 3, mN: weight and traction at full load
  std::vector<int> held;  ///< nodes that stay at X
};

/// Materials whose ln E differ by less than this become one.
inline constexpr double exported_ln_young_step = 1e-3;

/// Refuses what @p solver has no words for, before anything is computed.
/// @throws InputError  naming the term and what to change
void check_exportable(Solver solver, const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                      const std::vector<PoseLoad>& poses);

/// @param X, x  undeformed shape and our answer in the pose, mm
/// @pre check_exportable() passed
ExportedPose export_pose(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                         const PoseLoad& pose, const Points& X, const Points& x);

/// The dead forces of a pose whose springs are written as if they were free at u = 0: what they push with there is
/// added.
/// @return #nodes by 3, mN
Points force_with_springs_at_rest(const ExportedPose& pose);

/// Ending of the solver's input files: ".inp", ".feb", ".scn".
std::string export_extension(Solver solver);

/// Writes the solver's input file. Units: mm, kg, s, mN, kPa. Nodes are numbered as in mesh.vtu, from 1 (CalculiX,
/// FEBio) or 0 (SOFA).
/// @throws InputError  when the file cannot be written
void write_export(Solver solver, const ExportedPose& pose, const std::filesystem::path& file);

/// Writes our answer to hold theirs against: CSV node,ux_mm,uy_mm,uz_mm from the undeformed shape, nodes from 1.
/// @throws InputError  when the file cannot be written
void write_displacements(const ExportedPose& pose, const std::filesystem::path& file);

}  // namespace supine::simulation
