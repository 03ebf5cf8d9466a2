// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "simulation/equilibrium.h"

namespace supine::simulation {

/// How the undeformed shape is found. newton is the true inverse; the others are kept to be compared with:
/// fixed_point corrects X by the forward error until it is small (Sellier 2011), reversed_gravity loads the imaged
/// shape, taken as stress-free, with gravity turned round.
enum class InverseMethod { newton, fixed_point, reversed_gravity };

/// A body position to predict.
struct PoseLoad {
  std::string name;
  Eigen::Vector3d gravity;  ///< unit, LPS
};

struct PoseSolution {
  std::string name;
  Points x;  ///< mm
  SolveReport report;
};

struct ChainSolution {
  Points X;  ///< undeformed shape, mm
  SolveReport inverse;
  PoseSolution round_trip;       ///< prone again, from X and no load
  double round_trip_max_mm = 0;  ///< largest distance to the imaged nodes
  double round_trip_rms_mm = 0;
  std::vector<PoseSolution> poses;  ///< all but prone, in the order given
};

/// prone (imaged) → undeformed → every other pose, with the round trip as certificate.
/// @param poses  the first one is prone, the imaged pose
/// @throws NumericalFailure  naming the pose, InputError  prone gravity that points into the muscle (bound: the angle
/// to
///   the muscle's outward normal is under 90°)
ChainSolution solve_chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                          const std::vector<PoseLoad>& poses, InverseMethod method = InverseMethod::newton,
                          const SolveOptions& options = {});

/// ρ g H / E: how far the tissue's weight outdoes its stiffness; above about 2 shapes hardly carry themselves.
double load_number(const meshing::Anatomy& anatomy, const Model& model);

}  // namespace supine::simulation
