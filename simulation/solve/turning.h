// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "simulation/solve/equilibrium.h"

namespace supine::simulation {

/// How gravity turns about a body from one pose to another, at its full size: the way a patient takes who turns over. A
/// tall or soft breast that is laid on its back from its undeformed shape by growing gravity buckles; one that turns
/// over its side falls to it without.
struct Turn {
  Eigen::Vector3d from, to;  ///< gravity, unit
  /// Unit; taken on the way where from and to are more than 135° apart. Not parallel to them.
  Eigen::Vector3d over;

  double angle_deg() const;  ///< of the whole way
  /// Gravity after so many degrees. @param deg  0 to angle_deg()
  Eigen::Vector3d gravity_at(double deg) const;

 private:
  bool detour() const;
};

/// The turn to a pose of a patient imaged in another: over her outer side, or, where both breasts are in the mesh, over
/// her feet.
Turn turn_of(const meshing::Anatomy& anatomy, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Follows a shape in balance while gravity turns, 30° at a time and less where Newton's method does not come along.
/// @param load  sets the solver's fields for a gravity
/// @param X     undeformed nodes, #N by 3, mm
/// @param x     in: the shape in balance under turn.from; out: that under turn.to
/// @param what  names the solve
/// @return steps as load_steps, turned; nothing where the way ends before, or costs more than @p most_work
/// @post  the solver's work is no longer limited
std::optional<SolveReport> turn_over(EquilibriumSolver& solver, const Turn& turn,
                                     const std::function<void(const Eigen::Vector3d& gravity)>& load, const Points& X,
                                     Points& x, const std::string& what, int most_work);

}  // namespace supine::simulation
