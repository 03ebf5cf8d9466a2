// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <vector>

#include "phantom/causes/cause.h"
#include "phantom/nuisances.h"
#include "simulation/mechanics.h"

namespace supine::simulation {
class EquilibriumSolver;
}

namespace supine::phantom {

/// A body position of the phantom.
struct TruthPose {
  std::string name;
  Eigen::Vector3d gravity;  ///< unit, LPS, as the case file says
  Points x;                 ///< nodes, mm
};

/// prone, supine and, where wanted, tilt45; gravity only.
std::vector<TruthPose> truth_poses(bool tilt);

/// Base model of the truth; moduli of @p body.
simulation::Model truth_model(const Body& body);

/// A stress-free body with its causes and, where there are any, its nuisances.
class Truth {
 public:
  /// @param nuisances  or nullptr   @pre  it, mesh and body outlive the object
  Truth(const BodyMesh& body_mesh, const Body& body, const std::vector<Cause>& causes, const Nuisances* nuisances);

  /// Material and loads of one pose.
  simulation::Fields<double> fields(const TruthPose& pose) const;
  /// The mechanics of one pose, until the next is asked for.
  const simulation::Mechanics& in(const TruthPose& pose);
  enum class Start { no_load, shapes };
  /// Lets the body hang prone and lie in the other poses: one forward solve each.
  /// @param start  from no load, or beside the shapes that the poses have, no further than Newton's method comes from
  ///   there at once
  /// @throws NumericalFailure  no equilibrium
  void solve(std::vector<TruthPose>& poses, Start start = Start::no_load);

 private:
  void follow(simulation::EquilibriumSolver& solver, TruthPose& pose) const;

  const BodyMesh& body_mesh_;
  const Body& body_;
  std::vector<Cause> causes_;
  const Nuisances* nuisances_;
  simulation::Model model_;
  simulation::Mechanics mechanics_;
};

}  // namespace supine::phantom
