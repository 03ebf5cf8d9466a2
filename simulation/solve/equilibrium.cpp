// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "common/error.h"

namespace supine::simulation {
namespace {

constexpr double sufficient_decrease = 1e-4;  // Armijo constant
constexpr double natural_decrease = 0.25;     // Deuflhard's restricted monotonicity
constexpr int max_halvings = 12;
constexpr double longest_stride = 16;   // times a step of a changed tangent
constexpr double still_steep = 0.3;     // share of the slope left that makes going on worth while
constexpr double longest_step_mm = 40;  // a Newton step beyond this is shortened before the line search
constexpr int stall_window = 12;        // iterations in which the residual must fall to stall_share of what it was
constexpr double stall_share = 0.5;
constexpr double loosest_residual = 1e-4;  // stiff ties leave rounding behind; more than this is no equilibrium
constexpr double largest_fall = 0.1;       // det F may fall to this share of its value in one step
constexpr double crushed_det_f = 1e-3;     // an element that comes here is on its way through zero
constexpr double crushed_step_factor = 4;  // where elements are crushed, smaller load steps than this only repeat it

using Flat = Eigen::Map<Eigen::VectorXd>;

/// Forcing term of an inexact Newton method that keeps quadratic convergence (Eisenstat and Walker 1996, choice 2),
/// never finer than what the last digits need, or than what ends the solve at @p wanted_share.
double linear_tolerance(double residual_share, double share_before, double wanted_share) {
  constexpr double finest = 1e-6, coarsest = 1e-2, well_under = 0.3, loosest = 0.1;
  const double ratio = residual_share / share_before;
  const double quadratic = std::clamp(0.1 * ratio * ratio, finest, coarsest);
  return std::max(quadratic, std::min(well_under * wanted_share / residual_share, loosest));
}

}  // namespace

EquilibriumSolver::EquilibriumSolver(const Mechanics& mechanics, SolveOptions options)
    : mechanics_(mechanics), options_(std::move(options)), sums_(mechanics.pattern()), direction_(mechanics) {}

SolveReport EquilibriumSolver::forward(const Points& X, Points& x, const std::string& what, const Points* start) {
  return solve(Unknown::deformed, X, x, what, start);
}

SolveReport EquilibriumSolver::inverse(const Points& x, Points& X, const std::string& what, const Points* start) {
  return solve(Unknown::undeformed, x, X, what, start);
}

SolveReport EquilibriumSolver::solve(Unknown unknown, const Points& known, Points& sought, const std::string& what,
                                     const Points* start) {
  mechanics_.evaluate(State{known, known, 1.0}, Demand{.residual = true}, sums_);
  weight_norm_ = sums_.residual.norm();
  const int factorised_before = direction_.factorisations();
  what_ = what;
  SolveReport report;
  if (start != nullptr) {
    sought = *start;
    const Attempt attempt = newton(unknown, known, sought, 1.0);
    if (attempt.converged) {
      report = {attempt.iterations, direction_.factorisations() - factorised_before, 1, attempt.min_det_f,
                attempt.residual_share};
      return report;
    }
  }
  sought = known;
  report = step_load(unknown, known, sought);
  report.factorisations = direction_.factorisations() - factorised_before;
  return report;
}

EquilibriumSolver::Attempt EquilibriumSolver::attempt_step(Unknown unknown, const Points& known, const Points& ahead,
                                                           Points& trial, double load) {
  const Points from = trial;
  trial = ahead;
  Attempt attempt = newton(unknown, known, trial, load);
  if (attempt.converged || attempt.iterations > 0) return attempt;
  trial = from;  // the straight line led into an inverted element
  return newton(unknown, known, trial, load);
}

SolveReport EquilibriumSolver::step_load(Unknown unknown, const Points& known, Points& sought) {
  SolveReport report;
  double load = 0, load_before = 0, step = 1, failed = std::numeric_limits<double>::infinity();
  Points at_load = sought, before = sought, trial, ahead;
  while (load < 1) {
    const double target = std::min({1.0, load + step, failed});
    ahead = at_load;
    if (load > 0) ahead += (target - load) / (load - load_before) * (at_load - before);
    trial = at_load;
    const Attempt last = attempt_step(unknown, known, ahead, trial, target);
    report.newton_iterations += last.iterations;
    if (last.converged) {
      load_before = load;
      load = target;
      before.swap(at_load);
      at_load.swap(trial);
      if (load >= failed) failed = std::numeric_limits<double>::infinity();
      ++report.load_steps;
      report.residual_share = last.residual_share;
      report.min_det_f = last.min_det_f;
      if (last.iterations <= 8) step *= 2;
      continue;
    }
    failed = target;
    step = 0.5 * (target - load);
    if (step < options_.smallest_load_step * (last.crushed ? crushed_step_factor : 1))
      throw NumericalFailure(failure(last, load, trial));
  }
  sought = at_load;
  return report;
}

std::string EquilibriumSolver::failure(const Attempt& last, double load, const Points& shape) const {
  Eigen::RowVector3d at = shape.row(last.worst_node);
  std::string place = fmt::format("; furthest out of balance at ({:.1f}, {:.1f}, {:.1f}) mm", at.x(), at.y(), at.z());
  if (last.min_cell >= 0 && last.min_det_f < 0.1) {
    at.setZero();
    for (int a = 0; a < 4; ++a) at += 0.25 * shape.row(mechanics_.mesh().cells(last.min_cell, a));
    place = fmt::format("; smallest det F {:.3g} in cell {} at ({:.1f}, {:.1f}, {:.1f}) mm", last.min_det_f,
                        last.min_cell, at.x(), at.y(), at.z());
  }
  return fmt::format(
      "{}: no equilibrium found beyond {:.0f} % of gravity ({}{}). A softer tissue than this shape can carry, or a "
      "poor mesh there: raise breast.young_modulus_kpa or skin.young_modulus_kpa, use law = \"neo_hookean\", or "
      "look at the mesh with supine-tetrahedralise --check",
      what_, 100 * load, last.reason, place);
}

State EquilibriumSolver::state_of(Unknown unknown, const Points& known, const Points& sought, double load) {
  return unknown == Unknown::deformed ? State{sought, known, load} : State{known, sought, load};
}

void EquilibriumSolver::evaluate(Unknown unknown, const Points& known, const Points& sought, double load) {
  const bool forward = unknown == Unknown::deformed;
  const Demand demand{.energy = forward, .residual = true, .tangent = forward, .reference_tangent = !forward};
  mechanics_.evaluate(state_of(unknown, known, sought, load), demand, sums_);
}

void EquilibriumSolver::note_state(Attempt& attempt) const {
  attempt.min_det_f = sums_.min_det_f;
  attempt.min_cell = sums_.min_cell;
  if (sums_.valid)
    Eigen::Map<const Points>(sums_.residual.data(), sums_.residual.size() / 3, 3)
        .rowwise()
        .squaredNorm()
        .maxCoeff(&attempt.worst_node);
  attempt.residual_share = weight_norm_ > 0 ? sums_.residual.norm() / weight_norm_ : 0;
}

bool EquilibriumSolver::search_line(Unknown unknown, const Points& known, Points& sought, double load,
                                    const Eigen::VectorXd& step) {
  const bool use_energy = unknown == Unknown::deformed && mechanics_.has_energy();
  const double norm = sums_.residual.norm(), energy = sums_.energy, slope = sums_.residual.dot(step);
  const Eigen::VectorXd residual = use_energy ? Eigen::VectorXd() : sums_.residual;
  std::optional<double> natural;  // of that residual
  const double least_det_f = largest_fall * std::min(sums_.min_det_f, 1.0);
  const bool last_digits = step.cwiseAbs().maxCoeff() < options_.step_tolerance_mm;
  const Points start = sought;
  double alpha = 1;
  for (int halving = 0; halving <= max_halvings; ++halving, alpha *= 0.5) {
    Flat(sought.data(), sought.size()) = Eigen::Map<const Eigen::VectorXd>(start.data(), start.size()) + alpha * step;
    evaluate(unknown, known, sought, load);
    if (!sums_.valid || sums_.min_det_f < least_det_f) continue;
    if (last_digits) return true;  // the step moves by rounding only: neither merit says anything
    const double rounding = 1e-13 * (std::abs(energy) + std::abs(sums_.energy));
    if (use_energy ? sums_.energy <= energy + sufficient_decrease * alpha * slope + rounding
                   : sums_.residual.norm() <= (1 - sufficient_decrease * alpha) * norm) {
      if (use_energy && halving == 0 && !direction_.exact())
        go_further(unknown, known, start, sought, load, step, slope, least_det_f);
      return true;
    }
    if (use_energy) continue;
    if (!natural) natural = direction_.natural_mm(residual);
    if (direction_.natural_mm(sums_.residual) <= (1 - natural_decrease * alpha) * *natural) return true;
  }
  sought = start;
  return false;
}

void EquilibriumSolver::go_further(Unknown unknown, const Points& known, const Points& start, Points& sought,
                                   double load, const Eigen::VectorXd& step, double slope, double least_det_f) {
  const auto move = [&](double alpha) {
    Flat(sought.data(), sought.size()) = Eigen::Map<const Eigen::VectorXd>(start.data(), start.size()) + alpha * step;
    evaluate(unknown, known, sought, load);
  };
  double alpha = 1;
  while (alpha < longest_stride) {
    const double energy = sums_.energy, here = sums_.residual.dot(step);
    if (here > still_steep * slope) return;
    // Where the slope would be zero if it went on changing as it did so far.
    const double next = std::clamp(alpha * slope / (slope - here), 1.5 * alpha, 4 * alpha);
    const double guess = here < slope ? 4 * alpha : next;
    move(guess);
    if (!sums_.valid || sums_.min_det_f < least_det_f || sums_.energy > energy) {
      move(alpha);
      return;
    }
    alpha = guess;
  }
}

EquilibriumSolver::Attempt EquilibriumSolver::newton(Unknown unknown, const Points& known, Points& sought,
                                                     double load) {
  Attempt attempt;
  const auto give_up = [&attempt](std::string reason) {
    attempt.reason = std::move(reason);
    return attempt;
  };
  const auto stalled = [](int iteration, double share) {
    return fmt::format("no convergence in {} iterations, {:.1e} of the weight out of balance", iteration, share);
  };
  Eigen::VectorXd step;
  double share_before = 1;
  double at_window = std::numeric_limits<double>::infinity();  // residual when the present window of iterations began
  evaluate(unknown, known, sought, load);
  for (int iteration = 0;; ++iteration) {
    note_state(attempt);
    if (!sums_.valid) return give_up("an element is inverted");
    attempt.crushed = sums_.min_det_f < crushed_det_f;
    if (attempt.crushed && iteration > 0) return give_up("an element is crushed");
    if (options_.progress) options_.progress(what_, load, iteration, attempt.residual_share);
    const double moved = iteration == 0 ? longest_step_mm : step.cwiseAbs().maxCoeff();
    attempt.converged =
        attempt.residual_share <= options_.residual_tolerance ||
        (moved < options_.step_tolerance_mm && direction_.exact() && attempt.residual_share <= loosest_residual);
    if (attempt.converged) return attempt;
    if (iteration % stall_window == 0) {
      if (attempt.residual_share > stall_share * at_window) return give_up(stalled(iteration, attempt.residual_share));
      at_window = attempt.residual_share;
    }
    if (iteration == options_.max_iterations) return give_up(stalled(iteration, attempt.residual_share));
    ++attempt.iterations;
    const State state = state_of(unknown, known, sought, load);
    const double tolerance = linear_tolerance(attempt.residual_share, share_before, options_.residual_tolerance);
    share_before = attempt.residual_share;
    const bool found = unknown == Unknown::deformed ? direction_.deformed(state, tolerance, moved, sums_, step)
                                                    : direction_.undeformed(state, tolerance, sums_, step);
    if (!found) return give_up("the tangent matrix is singular");
    const double longest = step.cwiseAbs().maxCoeff();
    if (longest > longest_step_mm) step *= longest_step_mm / longest;
    if (!search_line(unknown, known, sought, load, step))
      return give_up(
          fmt::format("the line search stalled with {:.1e} of the weight out of balance", attempt.residual_share));
  }
}

}  // namespace supine::simulation
