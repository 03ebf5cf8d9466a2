// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/equilibrium.h"

#include <fmt/format.h>

#include <limits>

#include "common/error.h"

namespace supine::simulation {
namespace {

constexpr double sufficient_decrease = 1e-4;  // Armijo constant
constexpr int max_halvings = 12;
constexpr double longest_step_mm = 40;  // a Newton step beyond this is shortened before the line search
constexpr int stall_window = 12;        // iterations in which the residual must fall to stall_share of what it was
constexpr double stall_share = 0.5;
constexpr double loosest_residual = 1e-4;  // stiff ties leave rounding behind; more than this is no equilibrium
constexpr double largest_fall = 0.1;       // det F may fall to this share of its value in one step

using Flat = Eigen::Map<Eigen::VectorXd>;

}  // namespace

EquilibriumSolver::EquilibriumSolver(const Mechanics& mechanics, SolveOptions options)
    : mechanics_(mechanics), options_(std::move(options)), sums_(mechanics.pattern()) {}

SolveReport EquilibriumSolver::forward(const Points& X, Points& x, const std::string& what) {
  if (mechanics_.has_energy()) {
    if (!cholesky_) cholesky_ = std::make_unique<CholeskySolver>(sums_.tangent);
  } else if (!lu_) {
    lu_ = std::make_unique<LuSolver>(sums_.tangent);  // without an energy ∂r/∂x is not symmetric
  }
  x = X;
  return step_load(Unknown::deformed, X, x, what);
}

SolveReport EquilibriumSolver::inverse(const Points& x, Points& X, const std::string& what) {
  if (!lu_) lu_ = std::make_unique<LuSolver>(sums_.reference_tangent);
  X = x;
  return step_load(Unknown::undeformed, x, X, what);
}

SolveReport EquilibriumSolver::step_load(Unknown unknown, const Points& known, Points& sought,
                                         const std::string& what) {
  mechanics_.evaluate(State{known, known, 1.0}, Demand{.residual = true}, sums_);
  weight_norm_ = sums_.residual.norm();
  SolveReport report;
  factorisations_ = 0;
  what_ = what;
  double load = 0, step = 1;
  Points at_load = sought, trial;
  Attempt last;
  while (load < 1) {
    const double target = std::min(1.0, load + step);
    trial = at_load;
    last = newton(unknown, known, trial, target);
    report.newton_iterations += last.iterations;
    if (last.converged) {
      load = target;
      at_load = trial;
      ++report.load_steps;
      report.residual_share = last.residual_share;
      report.min_det_f = last.min_det_f;
      if (last.iterations <= 8) step *= 2;
      continue;
    }
    step = 0.5 * std::min(step, target - load);
    if (step >= options_.smallest_load_step) continue;
    const std::string place = [&] {
      if (last.min_cell < 0) return std::string();
      Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
      for (int a = 0; a < 4; ++a) centre += 0.25 * at_load.row(mechanics_.mesh().cells(last.min_cell, a));
      return fmt::format("; smallest det F {:.3g} in cell {} at ({:.1f}, {:.1f}, {:.1f}) mm", last.min_det_f,
                         last.min_cell, centre.x(), centre.y(), centre.z());
    }();
    throw NumericalFailure(fmt::format(
        "{}: no equilibrium found beyond {:.0f} % of gravity ({}{}). A softer tissue than this shape can carry, or a "
        "poor mesh there: raise breast.young_modulus_kpa or skin.young_modulus_kpa, use law = \"neo_hookean\", or "
        "look at the mesh with supine-tetrahedralise --check",
        what, 100 * load, last.reason, place));
  }
  sought = at_load;
  report.factorisations = factorisations_;
  return report;
}

State EquilibriumSolver::state_of(Unknown unknown, const Points& known, const Points& sought, double load) {
  return unknown == Unknown::deformed ? State{sought, known, load} : State{known, sought, load};
}

void EquilibriumSolver::evaluate(Unknown unknown, const Points& known, const Points& sought, double load) {
  const bool forward = unknown == Unknown::deformed;
  const Demand demand{.energy = forward, .residual = true, .tangent = forward, .reference_tangent = !forward};
  mechanics_.evaluate(state_of(unknown, known, sought, load), demand, sums_);
}

bool EquilibriumSolver::direction(Unknown unknown, const State& state, Eigen::VectorXd& step) {
  if (unknown == Unknown::deformed && mechanics_.has_energy()) return descent_direction(state, step);
  ++factorisations_;
  exact_direction_ = true;
  if (!lu_->factorise(unknown == Unknown::undeformed ? sums_.reference_tangent : sums_.tangent)) return false;
  step = -lu_->solve(sums_.residual);
  return step.allFinite();
}

bool EquilibriumSolver::descent_direction(const State& state, Eigen::VectorXd& step) {
  // The exact tangent where it is positive definite; where it is not, the one without the skin's negative curvature;
  // and if the tissue's is negative too, with the smallest shift that makes it so.
  double shift = 0;
  for (int attempt = 0; attempt < 10; ++attempt) {
    ++factorisations_;
    if (cholesky_->factorise(sums_.tangent, shift)) {
      exact_direction_ = attempt == 0;
      step = -cholesky_->solve(sums_.residual);
      return step.allFinite();
    }
    if (attempt == 0)
      mechanics_.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true, .convex = true}, sums_);
    else
      shift = attempt == 1 ? 1e-4 * sums_.tangent.diagonal().cwiseAbs().mean() : 6 * shift;
  }
  return false;
}

void EquilibriumSolver::note_state(Attempt& attempt) const {
  attempt.min_det_f = sums_.min_det_f;
  attempt.min_cell = sums_.min_cell;
  attempt.residual_share = weight_norm_ > 0 ? sums_.residual.norm() / weight_norm_ : 0;
}

bool EquilibriumSolver::search_line(Unknown unknown, const Points& known, Points& sought, double load,
                                    const Eigen::VectorXd& step) {
  const bool use_energy = unknown == Unknown::deformed && mechanics_.has_energy();
  const double norm = sums_.residual.norm(), energy = sums_.energy, slope = sums_.residual.dot(step);
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
                   : sums_.residual.norm() <= (1 - sufficient_decrease * alpha) * norm)
      return true;
  }
  sought = start;
  return false;
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
  double at_window = std::numeric_limits<double>::infinity();  // residual when the present window of iterations began
  evaluate(unknown, known, sought, load);
  for (int iteration = 0;; ++iteration) {
    note_state(attempt);
    if (!sums_.valid) return give_up("an element is inverted");
    if (options_.progress) options_.progress(what_, load, iteration, attempt.residual_share);
    const double moved = iteration == 0 ? longest_step_mm : step.cwiseAbs().maxCoeff();
    attempt.converged =
        attempt.residual_share <= options_.residual_tolerance ||
        (moved < options_.step_tolerance_mm && exact_direction_ && attempt.residual_share <= loosest_residual);
    if (attempt.converged) return attempt;
    if (iteration % stall_window == 0) {
      if (attempt.residual_share > stall_share * at_window) return give_up(stalled(iteration, attempt.residual_share));
      at_window = attempt.residual_share;
    }
    if (iteration == options_.max_iterations) return give_up(stalled(iteration, attempt.residual_share));
    ++attempt.iterations;
    if (!direction(unknown, state_of(unknown, known, sought, load), step))
      return give_up("the tangent matrix is singular");
    const double longest = step.cwiseAbs().maxCoeff();
    if (longest > longest_step_mm) step *= longest_step_mm / longest;
    if (!search_line(unknown, known, sought, load, step))
      return give_up(
          fmt::format("the line search stalled with {:.1e} of the weight out of balance", attempt.residual_share));
  }
}

}  // namespace supine::simulation
