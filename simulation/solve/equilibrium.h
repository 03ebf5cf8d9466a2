// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

#include "simulation/mechanics.h"
#include "simulation/solve/newton_direction.h"

namespace supine::simulation {

struct SolveOptions {
  int max_iterations = 40;            ///< Newton steps per load step
  double step_tolerance_mm = 1e-8;    ///< the last Newton step moved no node further
  double residual_tolerance = 1e-11;  ///< or |r| is under this share of the weight
  double smallest_load_step = 1.0 / 128;
  /// Told at every iteration which solve is under way; may be empty.
  std::function<void(const std::string& what, double load, int iteration, double residual_share)> progress;
};

struct SolveReport {
  int newton_iterations = 0;  ///< over all load steps
  int factorisations = 0;     ///< fewer than iterations where one serves several, more where the energy is not convex
  int load_steps = 0;         ///< completed
  double min_det_f = 1;
  double residual_share = 0;  ///< |r| / |weight| at the end
  int folded_cells = 0;       ///< filled by Chain: quadratic cells inside out between their quadrature points (folds.h)
};

/// Finds equilibrium r(x, X) = 0 by Newton's method with exact tangents, line search and adaptive load steps: the full
/// load is tried first; where that fails, half of the way to the load that failed; from the second step on it starts on
/// the straight line through the last two shapes. Symbolic analysis is done once per object.
class EquilibriumSolver {
 public:
  explicit EquilibriumSolver(const Mechanics& mechanics, SolveOptions options = {});

  /// Deformed shape for a known undeformed one. Merit: energy (for a law without energy that of inverse()).
  /// @param X  undeformed nodes   @param x  out: equilibrium at full load, reached from x = X and no load
  /// @param what  names the solve in messages, for example "supine"
  /// @param start  a shape close to the answer, tried first at full load; or nullptr
  /// @throws NumericalFailure  load fraction reached, worst element and place, what to change; x is then undefined
  SolveReport forward(const Points& X, Points& x, const std::string& what, const Points* start = nullptr);

  /// Undeformed shape whose equilibrium under the load is the known deformed one (Govindjee and Mihalic 1996;
  /// Mazier et al. 2022). Unknown X, matrix ∂r/∂X. A step is good when it lowers |r| or the way in mm that the kept
  /// factor still asks for: |r| alone stalls on slender bodies, where a step that bends rightly stretches a little.
  SolveReport inverse(const Points& x, Points& X, const std::string& what, const Points* start = nullptr);

  /// Forgets what earlier solves left behind to save work, so that the next ones give the same bytes as after making.
  void forget() { direction_.forget(); }

 private:
  enum class Unknown { deformed, undeformed };
  struct Attempt {
    bool converged = false;
    int iterations = 0;
    std::string reason;
    bool crushed = false;  ///< an element was about to turn inside out
    double min_det_f = 1;
    int min_cell = -1;
    Eigen::Index worst_node = 0;  ///< furthest out of balance
    double residual_share = 0;
  };
  SolveReport solve(Unknown unknown, const Points& known, Points& sought, const std::string& what, const Points* start);
  SolveReport step_load(Unknown unknown, const Points& known, Points& sought);
  Attempt attempt_step(Unknown unknown, const Points& known, const Points& ahead, Points& trial, double load);
  std::string failure(const Attempt& last, double load, const Points& shape) const;
  void note_state(Attempt& attempt) const;
  bool search_line(Unknown unknown, const Points& known, Points& sought, double load, const Eigen::VectorXd& step);
  /// A changed tangent is too stiff, so its steps are too short: goes on along @p step while the energy falls steeply.
  void go_further(Unknown unknown, const Points& known, const Points& start, Points& sought, double load,
                  const Eigen::VectorXd& step, double slope, double least_det_f);
  Attempt newton(Unknown unknown, const Points& known, Points& sought, double load);
  static State state_of(Unknown unknown, const Points& known, const Points& sought, double load);
  void evaluate(Unknown unknown, const Points& known, const Points& sought, double load);

  const Mechanics& mechanics_;
  SolveOptions options_;
  Sums sums_;
  NewtonDirection direction_;
  double weight_norm_ = 0;
  std::string what_;  // the solve under way, for progress and messages
};

}  // namespace supine::simulation
