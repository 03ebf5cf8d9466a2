// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/error.h"
#include "simulation/solve/newton_direction.h"
#include "simulation/solve/termination_words.h"

namespace supine::simulation {
namespace {

constexpr double rounding_mn = 1e-5;  // the weight of a microgram

// Load steps.
constexpr int quick_iterations = 8;        // a load step solved in so many is easy: the next one is twice as long
constexpr double crushed_step_factor = 4;  // where elements are crushed, smaller load steps than this only repeat it
constexpr double squeezed_det_f = 0.1;     // an element under this is the place to look at, not the worst balance
// Newton steps.
constexpr int cycles_per_step = 4;      // with what else belongs to a step and its factor
constexpr int short_stall_window = 4;   // stall_window, of solves that limit_work() bounds
constexpr double longest_step_mm = 40;  // a step beyond this is shortened before the line search
// Line search.
constexpr double sufficient_decrease = 1e-4;  // Armijo constant
constexpr double natural_decrease = 0.25;     // Deuflhard's restricted monotonicity
constexpr double largest_fall = 0.1;          // det F may fall to this share of its value in one step
constexpr double energy_rounding = 1e-13;     // relative: differences of energies below this say nothing
// Going on along a step of a changed tangent.
constexpr double longest_stride = 16;                  // times the step
constexpr double still_steep = 0.3;                    // share of the slope left that makes going on worth while
constexpr double least_growth = 1.5, most_growth = 4;  // of one stride over the last: an extrapolation is a guess

using Flat = Eigen::Map<Eigen::VectorXd>;
using ConstFlat = Eigen::Map<const Eigen::VectorXd>;

/// Forcing term of an inexact Newton method that keeps quadratic convergence (Eisenstat and Walker 1996, choice 2),
/// never finer than what the last digits need, or than what ends the solve at @p wanted_share.
double linear_tolerance(double residual_share, double share_before, double wanted_share) {
  constexpr double factor = 0.1;                    // γ of choice 2
  constexpr double finest = 1e-6, coarsest = 1e-2;  // past six digits a step's own error is larger than the solve's
  constexpr double well_under = 0.3;                // of what is wanted, so that the next residual is not just above
  constexpr double loosest = 0.1;                   // a looser solve would often cost a further step
  const double ratio = residual_share / share_before;
  const double quadratic = std::clamp(factor * ratio * ratio, finest, coarsest);
  return std::max(quadratic, std::min(well_under * wanted_share / residual_share, loosest));
}

/// What SolveOptions::most_work bounds.
int steps_and_factors(int steps, const NewtonDirection& direction) {
  return steps + work_of_factor * direction.factorisations();
}

}  // namespace

EquilibriumSolver::EquilibriumSolver(const Mechanics& mechanics, SolveOptions options)
    : mechanics_(mechanics),
      options_(std::move(options)),
      sums_(mechanics.pattern()),
      direction_(std::make_unique<NewtonDirection>(mechanics)) {}

EquilibriumSolver::~EquilibriumSolver() = default;

void EquilibriumSolver::forget() { direction_->forget(); }

SolveReport EquilibriumSolver::forward(const Points& X, Points& x, const std::string& what, const Points* start) {
  return solve(Unknown::deformed, X, x, what, start);
}

SolveReport EquilibriumSolver::inverse(const Points& x, Points& X, const std::string& what, const Points* start) {
  return solve(Unknown::undeformed, x, X, what, start);
}

int EquilibriumSolver::work() const {
  return steps_and_factors(steps_, *direction_) + direction_->cycles() / cycles_per_step;
}

/// What a solve is measured by.
void EquilibriumSolver::begin(const Points& known, const std::string& what) {
  mechanics_.evaluate(State{.x = known, .X = known, .load = 1.0}, Demand{.residual = true}, sums_);
  weight_norm_ = sums_.residual.norm();
  // A body that floats has no weight to compare with: it is balanced where only rounding is left.
  if (weight_norm_ < rounding_mn) weight_norm_ = rounding_mn / std::max(options_.residual_tolerance, 1e-16);
  solve_end_ = steps_and_factors(steps_, *direction_) + options_.most_work;
  what_ = what;
}

SolveReport EquilibriumSolver::from_start(const Attempt& attempt, int factorised_before) const {
  return {.newton_iterations = attempt.iterations,
          .factorisations = direction_->factorisations() - factorised_before,
          .load_steps = 1,
          .min_det_f = attempt.min_det_f,
          .residual_share = attempt.residual_share,
          .termination = attempt.end};
}

std::optional<SolveReport> EquilibriumSolver::forward_from(const Points& X, Points& x, const std::string& what) {
  begin(X, what);
  const int factorised_before = direction_->factorisations();
  const Attempt attempt = newton({.unknown = Unknown::deformed, .known = X, .load = 1.0}, x);
  if (!converged(attempt.end)) return std::nullopt;
  return from_start(attempt, factorised_before);
}

SolveReport EquilibriumSolver::solve(Unknown unknown, const Points& known, Points& sought, const std::string& what,
                                     const Points* start) {
  begin(known, what);
  const int factorised_before = direction_->factorisations();
  if (start != nullptr) {
    sought = *start;
    const Attempt attempt = newton({.unknown = unknown, .known = known, .load = 1.0}, sought);
    if (converged(attempt.end)) return from_start(attempt, factorised_before);
  }
  sought = known;
  SolveReport report = step_load(unknown, known, sought);
  report.factorisations = direction_->factorisations() - factorised_before;
  return report;
}

SolveReport EquilibriumSolver::step_load(Unknown unknown, const Points& known, Points& sought) {
  constexpr double none = std::numeric_limits<double>::infinity();
  SolveReport report;
  double load = 0, load_before = 0, step = 1, failed = none;
  Points at_load = sought, before = sought, trial, ahead;
  while (load < 1) {
    const double target = std::min({1.0, load + step, failed});
    ahead = at_load;
    if (load > 0) ahead += (target - load) / (load - load_before) * (at_load - before);
    const Attempt last = attempt_step({.unknown = unknown, .known = known, .load = target}, at_load, ahead, trial);
    report.newton_iterations += last.iterations;
    if (converged(last.end)) {
      load_before = load;
      load = target;
      before.swap(at_load);
      at_load.swap(trial);
      if (load >= failed) failed = none;
      ++report.load_steps;
      report.residual_share = last.residual_share;
      report.min_det_f = last.min_det_f;
      report.termination = last.end;
      if (last.iterations <= quick_iterations) step *= 2;
      continue;
    }
    failed = target;
    step = 0.5 * (target - load);
    const bool crushed = last.end != Termination::inverted && last.min_det_f < crushed_det_f;
    if (last.end == Termination::work_limit || step < options_.smallest_load_step * (crushed ? crushed_step_factor : 1))
      throw NoEquilibrium(failure(last, load, trial), load);
  }
  sought = at_load;
  return report;
}

EquilibriumSolver::Attempt EquilibriumSolver::attempt_step(const Problem& problem, const Points& from,
                                                           const Points& ahead, Points& trial) {
  trial = ahead;
  const Attempt attempt = newton(problem, trial);
  if (converged(attempt.end) || attempt.iterations > 0) return attempt;
  trial = from;  // the straight line led into an inverted element
  return newton(problem, trial);
}

std::string EquilibriumSolver::failure(const Attempt& last, double load, const Points& shape) const {
  Eigen::RowVector3d at = shape.row(last.worst_node);
  std::string place = fmt::format("; furthest out of balance at ({:.1f}, {:.1f}, {:.1f}) mm", at.x(), at.y(), at.z());
  if (last.min_cell >= 0 && last.min_det_f < squeezed_det_f) {
    at.setZero();
    for (int a = 0; a < 4; ++a) at += 0.25 * shape.row(mechanics_.mesh().cells(last.min_cell, a));
    place = fmt::format("; smallest det F {:.3g} in cell {} at ({:.1f}, {:.1f}, {:.1f}) mm", last.min_det_f,
                        last.min_cell, at.x(), at.y(), at.z());
  }
  return fmt::format(
      "{}: no equilibrium found beyond {:.0f} % of gravity ({}{}). A softer tissue than this shape can carry, or a "
      "poor mesh there: raise breast.young_modulus_kpa or skin.young_modulus_kpa, or look at the mesh with "
      "supine-tetrahedralise --check",
      what_, 100 * load, termination_words(last.end, last.iterations, last.residual_share), place);
}

State EquilibriumSolver::state_of(const Problem& problem, const Points& sought) const {
  const Eigen::VectorXd* strain = volume_strain_.size() > 0 ? &volume_strain_ : nullptr;
  const bool forward = problem.unknown == Unknown::deformed;
  const Points &x = forward ? sought : problem.known, &X = forward ? problem.known : sought;
  return {.x = x, .X = X, .load = problem.load, .volume_strain = strain};
}

/// Fills the sums with what a step and the merit need.
void EquilibriumSolver::evaluate(const Problem& problem, const Points& sought) {
  const bool forward = problem.unknown == Unknown::deformed;
  const Demand demand{.energy = forward, .residual = true, .tangent = forward, .reference_tangent = !forward};
  mechanics_.evaluate(state_of(problem, sought), demand, sums_);
}

EquilibriumSolver::Attempt EquilibriumSolver::newton(const Problem& problem, Points& sought) {
  Attempt attempt;
  Eigen::VectorXd step;
  const auto ended = [&attempt](Termination end) {
    attempt.end = end;
    return attempt;
  };
  start_volume(problem, sought);
  evaluate(problem, sought);
  for (;;) {
    measure(attempt);
    if (const auto end = unusable(attempt)) return ended(*end);
    if (options_.progress) options_.progress(what_, problem.load, attempt.iterations, attempt.residual_share);
    if (const auto end = settled(attempt, by_energy(problem))) return ended(*end);
    if (!find_step(problem, sought, attempt, step)) return ended(Termination::singular_tangent);
    if (!search_line(problem, attempt, step, sought)) return ended(Termination::line_search_failed);
  }
}

/// Notes where the shape of the sums stands.
void EquilibriumSolver::measure(Attempt& attempt) const {
  attempt.min_det_f = sums_.min_det_f;
  attempt.min_cell = sums_.min_cell;
  if (sums_.valid)
    Eigen::Map<const Points>(sums_.residual.data(), sums_.residual.size() / 3, 3)
        .rowwise()
        .squaredNorm()
        .maxCoeff(&attempt.worst_node);
  attempt.residual_share = weight_norm_ > 0 ? sums_.residual.norm() / weight_norm_ : 0;
}

/// Whether the shape is none that a step can start from.
std::optional<Termination> EquilibriumSolver::unusable(const Attempt& attempt) const {
  if (!sums_.valid) return Termination::inverted;
  if (attempt.iterations > 0 && attempt.min_det_f < crushed_det_f) return Termination::crushed;
  return std::nullopt;
}

/// Whether the answer is found, or further steps will not find it.
std::optional<Termination> EquilibriumSolver::settled(Attempt& attempt, bool by_energy) const {
  const double share = attempt.residual_share;
  if (share <= options_.residual_tolerance) return Termination::residual_small;
  if (attempt.moved_mm < options_.step_tolerance_mm && direction_->exact() && share <= loosest_residual_share)
    return Termination::step_small;
  if (const auto end = aimless(attempt, by_energy)) return end;
  const bool arriving = attempt.iterations > 0 && direction_->exact() && share < arriving_share &&
                        share < arriving_fall * attempt.share_before;
  if (arriving) return std::nullopt;
  if (attempt.iterations >= options_.max_iterations) return Termination::iteration_limit;
  if (steps_and_factors(steps_, *direction_) >= solve_end_ || work() >= work_end_) return Termination::work_limit;
  return std::nullopt;
}

/// At the end of a window, whether neither residual nor energy fell much in it, or the energy as if without end. The
/// energy of a shape far from the answer falls for long before the residual does. Of what may cost no more than so much
/// the window is shorter: beside a fold, where two shapes meet and end, steps grow and the residual stays.
std::optional<Termination> EquilibriumSolver::aimless(Attempt& attempt, bool by_energy) const {
  const int window = work_end_ == unlimited ? stall_window : short_stall_window;
  if (attempt.iterations % window != 0) return std::nullopt;
  if (attempt.iterations == 0) attempt.energy_at_start = sums_.energy;
  const double fall = attempt.energy_at_window - sums_.energy, whole = attempt.energy_at_start - sums_.energy;
  const bool falls = by_energy && fall > energy_share * whole && fall > energy_rounding * std::abs(sums_.energy);
  const bool creeps =
      attempt.iterations > 0 && !falls && attempt.residual_share > stall_share * attempt.share_at_window;
  const bool slides =
      falls && window == stall_window && attempt.iterations > sliding_after && fall > sliding_share * whole;
  attempt.share_at_window = attempt.residual_share;
  attempt.energy_at_window = sums_.energy;
  if (creeps) return Termination::stalled;
  if (slides) return Termination::sliding;
  return std::nullopt;
}

bool EquilibriumSolver::by_energy(const Problem& problem) const {
  return problem.unknown == Unknown::deformed && mechanics_.has_energy();
}

/// The next Newton step, no longer than longest_step_mm and than keeps skin before skin. @return false when there is
/// none
bool EquilibriumSolver::find_step(const Problem& problem, const Points& sought, Attempt& attempt,
                                  Eigen::VectorXd& step) {
  ++attempt.iterations, ++steps_;
  const State state = state_of(problem, sought);
  const double tolerance = linear_tolerance(attempt.residual_share, attempt.share_before, options_.residual_tolerance);
  attempt.share_before = attempt.residual_share;
  const bool found = problem.unknown == Unknown::deformed
                         ? direction_->deformed(state, tolerance, attempt.moved_mm, sums_, step)
                         : direction_->undeformed(state, tolerance, sums_, step);
  if (!found) return false;
  const double longest = step.cwiseAbs().maxCoeff();
  attempt.step_share = std::min(1.0, longest_step_mm / longest);
  if (problem.unknown == Unknown::deformed && mechanics_.contact() != nullptr)
    attempt.step_share *= mechanics_.contact()->safe_share(sought, attempt.step_share * step);
  if (attempt.step_share < 1) step *= attempt.step_share;
  attempt.moved_mm = step.cwiseAbs().maxCoeff();
  return true;
}

/// Moves @p sought along the step as far as lowers the merit. @return false, and @p sought as it was, where none does
bool EquilibriumSolver::search_line(const Problem& problem, const Attempt& attempt, const Eigen::VectorXd& step,
                                    Points& sought) {
  const bool by_energy = this->by_energy(problem);
  Line line{.start = sought,
            .step = step,
            .by_energy = by_energy,
            .energy = sums_.energy,
            .slope = sums_.residual.dot(step),
            .residual_norm = sums_.residual.norm(),
            .residual = by_energy ? Eigen::VectorXd() : sums_.residual,
            .natural_mm = std::nullopt,
            .volume_strain = volume_strain_,
            .strain_step = {},
            .mixed_norm = 0,
            .least_det_f = largest_fall * std::min(sums_.min_det_f, 1.0)};
  if (by_energy && volume_strain_.size() > 0) {
    follow_volume(problem, attempt.step_share, line);
    line.mixed_norm = mixed_norm(state_of(problem, sought), sums_.residual);
  }
  const bool last_digits = step.cwiseAbs().maxCoeff() < options_.step_tolerance_mm;
  double alpha = 1;
  for (int halving = 0; halving <= max_halvings; ++halving, alpha *= 0.5) {
    move_along(problem, line, alpha, sought);
    if (!keeps_volume(line)) continue;
    if (last_digits) return true;  // the step moves by rounding only: no merit says anything
    if (!lowers_merit(problem, sought, line, alpha)) continue;
    if (by_energy && halving == 0 && !direction_->exact()) go_further(problem, line, sought);
    return true;
  }
  sought = line.start;
  volume_strain_ = line.volume_strain;
  return false;
}

/// Takes q from the shape, where the problem is one that follows it.
void EquilibriumSolver::start_volume(const Problem& problem, const Points& sought) {
  volume_strain_.resize(0);
  if (problem.unknown != Unknown::deformed || !mechanics_.has_energy() || !mechanics_.volume().nearly_incompressible())
    return;
  Eigen::VectorXd none;
  mechanics_.volume().volume_strain(state_of(problem, sought), none, volume_strain_, none);
}

/// How the step, @p share of a Newton step, moves q: as the linear system says.
void EquilibriumSolver::follow_volume(const Problem& problem, double share, Line& line) const {
  Eigen::VectorXd strain;
  mechanics_.volume().volume_strain(state_of(problem, line.start), line.step, strain, line.strain_step);
  line.strain_step += share * (strain - line.volume_strain);
}

/// |r| of the mixed form, of which q is an unknown too.
double EquilibriumSolver::mixed_norm(const State& state, const Eigen::VectorXd& residual) {
  mixed_residual_ = residual;
  mechanics_.volume().take_off_pressure_defect(state, mixed_residual_);
  return mixed_residual_.norm();
}

/// Whether the shape of the sums, @p alpha steps along the line, is better than where that starts.
bool EquilibriumSolver::lowers_merit(const Problem& problem, const Points& sought, Line& line, double alpha) {
  if (line.by_energy) {
    const double rounding = energy_rounding * (std::abs(line.energy) + std::abs(sums_.energy));
    if (sums_.energy <= line.energy + sufficient_decrease * alpha * line.slope + rounding) return true;
    if (line.volume_strain.size() == 0) return false;
    return mixed_norm(state_of(problem, sought), sums_.residual) <= (1 - sufficient_decrease * alpha) * line.mixed_norm;
  }
  if (sums_.residual.norm() <= (1 - sufficient_decrease * alpha) * line.residual_norm) return true;
  if (!line.natural_mm) line.natural_mm = direction_->natural_mm(line.residual);
  return direction_->natural_mm(sums_.residual) <= (1 - natural_decrease * alpha) * *line.natural_mm;
}

bool EquilibriumSolver::keeps_volume(const Line& line) const {
  return sums_.valid && sums_.min_det_f >= line.least_det_f;
}

/// A changed tangent is too stiff, so its steps are too short: from the end of the step goes on along the line while
/// the energy falls steeply.
void EquilibriumSolver::go_further(const Problem& problem, const Line& line, Points& sought) {
  double alpha = 1;
  while (alpha < longest_stride) {
    const double energy = sums_.energy, slope = sums_.residual.dot(line.step);
    if (slope > still_steep * line.slope) return;
    // Where the slope would be zero if it went on changing as it did so far.
    const double zero_slope = alpha * line.slope / (line.slope - slope);
    const double next = std::clamp(zero_slope, least_growth * alpha, most_growth * alpha);
    const double guess = slope < line.slope ? most_growth * alpha : next;
    move_along(problem, line, guess, sought);
    if (!keeps_volume(line) || sums_.energy > energy) {
      move_along(problem, line, alpha, sought);
      return;
    }
    alpha = guess;
  }
}

/// Puts @p sought @p alpha steps along the line, and the sums with it.
void EquilibriumSolver::move_along(const Problem& problem, const Line& line, double alpha, Points& sought) {
  Flat(sought.data(), sought.size()) = ConstFlat(line.start.data(), line.start.size()) + alpha * line.step;
  if (line.strain_step.size() > 0) volume_strain_ = line.volume_strain + alpha * line.strain_step;
  evaluate(problem, sought);
}

}  // namespace supine::simulation
