// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "common/error.h"
#include "simulation/mechanics.h"

namespace supine::simulation {

class NewtonDirection;

struct SolveOptions {
  int max_iterations = 100;               ///< Newton steps per load step, >= 0
  int most_work = 600;                    ///< of one solve: steps and factorisations of EquilibriumSolver::work(), >= 0
  double step_tolerance_mm = 1e-8;        ///< of Termination::step_small, >= 0
  double residual_tolerance = 1e-11;      ///< of Termination::residual_small, share of the weight, >= 0
  double smallest_load_step = 1.0 / 128;  ///< share of the load, in (0, 1]
  /// Told at every iteration which solve is under way; may be empty. Each pose of a Chain has a copy, and several may
  /// be called at the same time.
  std::function<void(const std::string& what, double load, int iteration, double residual_share)> progress;
};

/// Stiff ties leave rounding behind; a larger share of the weight out of balance is no equilibrium.
inline constexpr double loosest_residual_share = 1e-4;
/// An element that comes to this det F is on its way through zero, where laws without a barrier let it pass.
inline constexpr double crushed_det_f = 1e-3;
/// Iterations in which the residual must fall to stall_share of what it was, or the energy by energy_share of what it
/// has fallen since the load step began: a tangent that keeps being changed creeps.
inline constexpr int stall_window = 12;
inline constexpr double stall_share = 0.5;
inline constexpr double energy_share = 0.02;
/// A body that finds its balance has lost nearly all of the energy that it will lose after two such windows. One that
/// slides off goes on losing it: more than this share, in a window, of what it has lost since the load step began.
inline constexpr int sliding_after = 2 * stall_window;
inline constexpr double sliding_share = 0.03;
/// A step of the exact tangent that takes so small a residual to so small a part of it is followed by few more: neither
/// iterations nor work end a solve there.
inline constexpr double arriving_share = 1e-3;
inline constexpr double arriving_fall = 0.1;
/// A factorisation costs about as much as so many Newton steps without one (linear cells, 10,000 nodes).
inline constexpr int work_of_factor = 4;
/// Of a Newton step: where 1/4096 of it is still too long, shorter load steps help more than shorter Newton steps.
inline constexpr int max_halvings = 12;

/// How Newton's method ended at one load. r is the residual, w the weight: the residual of the known shape taken as x
/// and X at full load. det F is the smallest over the quadrature points. Those above the line are equilibria.
enum class Termination {
  residual_small,  ///< |r| <= residual_tolerance |w|
  step_small,      ///< max |s_i| < step_tolerance_mm for the last step s, which NewtonDirection::exact() says is of the
                   ///< exact tangent, and |r| <= loosest_residual_share |w|
  // ----
  inverted,            ///< det F <= 0, or det ∂X/∂ξ <= 0 in an element, in the shape Newton's method starts from
  crushed,             ///< 0 < det F < crushed_det_f after a step
  stalled,             ///< |r_k| > stall_share |r_(k - stall_window)| at iteration k, a multiple of stall_window, and
                       ///< W_(k - stall_window) - W_k < energy_share (W_0 - W_k) where the merit is the energy W
  sliding,             ///< W_(k - stall_window) - W_k > sliding_share (W_0 - W_k) at an iteration k > sliding_after, a
                       ///< multiple of stall_window, where the merit is the energy W
  iteration_limit,     ///< max_iterations steps were taken, and the last was not arriving
  singular_tangent,    ///< NewtonDirection found no step
  work_limit,          ///< the same of SolveOptions::most_work, or of what limit_work() leaves
  line_search_failed,  ///< no 2^-h of the step, h = 0 .. max_halvings, lowers the merit and keeps det F
};

/// Whether the shape is an equilibrium.
constexpr bool converged(Termination end) {
  return end == Termination::residual_small || end == Termination::step_small;
}

struct SolveReport {
  int newton_iterations = 0;  ///< over all load steps
  int factorisations = 0;     ///< fewer than iterations where one serves several, more where the energy is not convex
  int load_steps = 0;         ///< completed
  double min_det_f = 1;       ///< smallest det F (F = ∂x/∂X) over the quadrature points
  double residual_share = 0;  ///< |r| / |w| at the end, as in Termination; 0 without weight
  Termination termination = Termination::residual_small;  ///< of the last load step: one of the converged
  int folded_cells = 0;  ///< filled by Chain: quadratic cells inside out between their quadrature points (folds.h)
};

/// No shape in balance was found under the whole load.
class NoEquilibrium : public NumericalFailure {
 public:
  NoEquilibrium(const std::string& message, double load) : NumericalFailure(message), load_(load) {}
  /// The largest share of the load that was balanced, 0 to 1.
  double load() const { return load_; }

 private:
  double load_;
};

/// Finds equilibrium r(x, X) = 0 by Newton's method with exact tangents, line search and adaptive load steps: the full
/// load is tried first; where that fails, half of the way to the load that failed; from the second step on it starts on
/// the straight line through the last two shapes. Symbolic analysis is done once per object.
class EquilibriumSolver {
 public:
  /// @param mechanics  must outlive the object; its fields may be set anew between solves
  explicit EquilibriumSolver(const Mechanics& mechanics, SolveOptions options = {});
  ~EquilibriumSolver();

  /// Deformed shape for a known undeformed one. Merit: energy (for a law without energy that of inverse()).
  /// @param X  undeformed nodes, #N by 3, mm
  /// @param x  out: equilibrium at full load, #N by 3, mm, reached from x = X and no load
  /// @param what  names the solve in messages, for example "undeformed → supine"
  /// @param start  a shape close to the answer, tried first at full load; or nullptr
  /// @throws NumericalFailure  load fraction reached, worst element and place, what to change; x is then undefined
  SolveReport forward(const Points& X, Points& x, const std::string& what, const Points* start = nullptr);

  /// The same from a shape close to the answer alone, at full load.
  /// @param x  in: that shape; out: the answer
  /// @return nothing, and x undefined, where Newton's method does not come to an equilibrium from there
  std::optional<SolveReport> forward_from(const Points& X, Points& x, const std::string& what);

  /// Undeformed shape whose equilibrium under the load is the known deformed one (Govindjee and Mihalic 1996;
  /// Mazier et al. 2022). Unknown X, matrix ∂r/∂X. A step is good when it lowers |r| or the way in mm that the kept
  /// factor still asks for: |r| alone stalls on slender bodies, where a step that bends rightly stretches a little.
  /// Parameters and errors as of forward(), with x and X changing places.
  SolveReport inverse(const Points& x, Points& X, const std::string& what, const Points* start = nullptr);

  /// What was spent since the object was made, failed load steps included: Newton steps, work_of_factor more for each
  /// factorisation, and Krylov iterations at what they take. Counted, not timed: the same on every machine.
  int work() const;
  /// What solves from now on may cost together, beside SolveOptions::most_work of each; beyond it they end with
  /// NoEquilibrium. Until it is called again; nullopt = no such bound.
  void limit_work(std::optional<int> most) { work_end_ = most ? work() + *most : unlimited; }

  /// Forgets what earlier solves left behind to save work, so that the next ones give the same bytes as after making.
  void forget();

 private:
  enum class Unknown { deformed, undeformed };
  /// One system of equations: which shape is sought, the other one, and the share of the load.
  struct Problem {
    Unknown unknown;
    const Points& known;
    double load;
  };
  /// Newton's method at one load: where it is, and in the end how it ended.
  struct Attempt {
    static constexpr double unknown_yet = std::numeric_limits<double>::infinity();
    Termination end = Termination::iteration_limit;
    int iterations = 0;
    double min_det_f = 1;
    int min_cell = -1;
    Eigen::Index worst_node = 0;  ///< furthest out of balance
    double residual_share = 0;
    double share_before = 1;                           ///< residual_share one iteration before
    double share_at_window = unknown_yet;              ///< residual_share when the present stall_window began
    double energy_at_window = 0, energy_at_start = 0;  ///< of the sums, where the merit is the energy
    double moved_mm = unknown_yet;                     ///< largest part of the last step along an axis
    double step_share = 1;                             ///< of the last Newton step, what longest_step_mm left of it
  };
  /// The line that a Newton step draws, and what is known where it starts.
  struct Line {
    Points start;
    const Eigen::VectorXd& step;
    bool by_energy;  ///< the merit; else by the residual
    double energy, slope;
    double residual_norm;
    Eigen::VectorXd residual;          ///< only if not by energy
    std::optional<double> natural_mm;  ///< of that residual, once asked for
    Eigen::VectorXd volume_strain;     ///< q where it starts; empty where it is not followed
    Eigen::VectorXd strain_step;       ///< how the step moves q
    double mixed_norm = 0;             ///< of the mixed form's residual where it starts
    double least_det_f;                ///< that a shape on the line must keep
  };

  void begin(const Points& known, const std::string& what);
  SolveReport from_start(const Attempt& attempt, int factorised_before) const;
  SolveReport solve(Unknown unknown, const Points& known, Points& sought, const std::string& what, const Points* start);
  SolveReport step_load(Unknown unknown, const Points& known, Points& sought);
  Attempt attempt_step(const Problem& problem, const Points& from, const Points& ahead, Points& trial);
  std::string failure(const Attempt& last, double load, const Points& shape) const;

  Attempt newton(const Problem& problem, Points& sought);
  void measure(Attempt& attempt) const;
  std::optional<Termination> unusable(const Attempt& attempt) const;
  std::optional<Termination> settled(Attempt& attempt, bool by_energy) const;
  std::optional<Termination> aimless(Attempt& attempt, bool by_energy) const;
  bool by_energy(const Problem& problem) const;
  bool find_step(const Problem& problem, const Points& sought, Attempt& attempt, Eigen::VectorXd& step);

  bool search_line(const Problem& problem, const Attempt& attempt, const Eigen::VectorXd& step, Points& sought);
  bool lowers_merit(const Problem& problem, const Points& sought, Line& line, double alpha);
  bool keeps_volume(const Line& line) const;
  void go_further(const Problem& problem, const Line& line, Points& sought);
  void move_along(const Problem& problem, const Line& line, double alpha, Points& sought);

  void start_volume(const Problem& problem, const Points& sought);
  void follow_volume(const Problem& problem, double share, Line& line) const;
  double mixed_norm(const State& state, const Eigen::VectorXd& residual);
  State state_of(const Problem& problem, const Points& sought) const;
  void evaluate(const Problem& problem, const Points& sought);

  const Mechanics& mechanics_;
  SolveOptions options_;
  Sums sums_;
  std::unique_ptr<NewtonDirection> direction_;
  double weight_norm_ = 0;
  Eigen::VectorXd volume_strain_;   // q of VolumeStrainTerm at the shape of the sums; empty where it is not followed
  Eigen::VectorXd mixed_residual_;  // work space
  static constexpr int unlimited = std::numeric_limits<int>::max();
  int steps_ = 0;              // Newton steps since the object was made
  int work_end_ = unlimited;   // of work(): bound of limit_work()
  int solve_end_ = unlimited;  // of its steps and factorisations: bound of the solve under way
  std::string what_;           // the solve under way, for progress and messages
};

}  // namespace supine::simulation
