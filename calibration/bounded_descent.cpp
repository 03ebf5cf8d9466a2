// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/bounded_descent.h"

#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "calibration/chain_cost.h"
#include "common/error.h"

namespace supine::calibration {
namespace {

using State = ChainCost::State;

constexpr double settled_sd = 0.05, rough_sd = 0.1;

/// Which coordinates do not move, and why.
class ActiveSet {
 public:
  ActiveSet(const FreeParameters& parameters, const std::vector<bool>& held)
      : parameters_(parameters), held_(held), at_bound_(static_cast<std::size_t>(parameters.size()), false) {
    held_.resize(at_bound_.size(), false);
  }

  bool moves(Eigen::Index i) const {
    return !held_[static_cast<std::size_t>(i)] && !at_bound_[static_cast<std::size_t>(i)];
  }

  std::vector<int> moving() const {
    std::vector<int> list;
    for (int i = 0; i < parameters_.size(); ++i)
      if (moves(i)) list.push_back(i);
    return list;
  }

  /// Takes in what has come to sit at its bound. @return whether anything has
  bool take_in(const State& state) {
    bool changed = false;
    for (Eigen::Index i = 0; i < parameters_.size(); ++i)
      if (moves(i) && pushes_out(state, i)) changed = at_bound_[static_cast<std::size_t>(i)] = true;
    return changed;
  }

  /// Lets go what would now gain inside its range. @return whether anything has been let go
  bool let_go(const State& state, double worth) {
    bool changed = false;
    for (Eigen::Index i = 0; i < parameters_.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double gain = state.gradient[i] * state.gradient[i] / state.information(i, i);
      if (!at_bound_[k] || pushes_out(state, i) || !(gain > worth)) continue;
      at_bound_[k] = false;
      changed = true;
    }
    return changed;
  }

 private:
  bool pushes_out(const State& state, Eigen::Index i) const {
    return (state.u[i] <= parameters_.lower()[i] && state.gradient[i] >= 0) ||
           (state.u[i] >= parameters_.upper()[i] && state.gradient[i] <= 0);
  }

  const FreeParameters& parameters_;
  std::vector<bool> held_, at_bound_;
};

/// Square of the Gauss-Newton step in standard deviations, over the coordinates that move.
double squared_step_sd(const State& state, const std::vector<int>& moving) {
  if (moving.empty()) return 0;
  const Eigen::VectorXd gradient = state.gradient(moving);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(state.information(moving, moving));
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * gradient;
  // Directions that move nothing, up to rounding, have nothing to gain.
  const double least = 1e-12 * eigen.eigenvalues().maxCoeff();
  double squared = 0;
  for (Eigen::Index i = 0; i < along.size(); ++i)
    if (eigen.eigenvalues()[i] > least) squared += along[i] * along[i] / eigen.eigenvalues()[i];
  return squared;
}

/// Ends Ceres' iterations when they have settled, or when a coordinate has come to its bound.
class Watch : public ceres::IterationCallback {
 public:
  Watch(const ChainCost& cost, ActiveSet& active, double step_sd) : cost_(cost), active_(active), step_sd_(step_sd) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    const State& state = cost_.accepted();
    bound_met_ = active_.take_in(state);
    settled_ = !bound_met_ && squared_step_sd(state, active_.moving()) < worth();
    return bound_met_ || settled_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

  bool bound_met() const { return bound_met_; }
  bool settled() const { return settled_; }
  /// Twice the fall of the cost that is worth a chain run.
  double worth() const {
    const State& state = cost_.accepted();
    const double mean_square = 2 * state.cost / static_cast<double>(state.jacobian.rows());
    return step_sd_ * step_sd_ * std::max(1.0, mean_square);
  }

 private:
  const ChainCost& cost_;
  ActiveSet& active_;
  double step_sd_;
  bool bound_met_ = false, settled_ = false;
};

ceres::Solver::Options solver_options(int most_iterations, Watch& watch) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = most_iterations;
  solver.line_search_interpolation_type = ceres::QUADRATIC;  // of values: no sensitivities at trial points
  solver.function_tolerance = 1e-9;                          // settled comes first, but where distances have kinks
  solver.parameter_tolerance = 1e-6;
  solver.gradient_tolerance = 1e-10;
  solver.max_num_consecutive_invalid_steps = 8;
  solver.logging_type = ceres::SILENT;
  solver.callbacks = {&watch};
  return solver;
}

/// Ceres from @p u until settled, at a bound, or at its wits' end.
ceres::Solver::Summary solve(ChainCost& cost, const FreeParameters& parameters, const ActiveSet& active, Watch& watch,
                             int most_iterations, Eigen::VectorXd u) {
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  std::vector<double*> blocks;
  for (double& coordinate : u) blocks.push_back(&coordinate);
  problem.AddResidualBlock(&cost, nullptr, blocks);
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    double* block = blocks[static_cast<std::size_t>(i)];
    if (!active.moves(i)) {
      problem.SetParameterBlockConstant(block);
      continue;
    }
    problem.SetParameterLowerBound(block, 0, parameters.lower()[i]);
    problem.SetParameterUpperBound(block, 0, parameters.upper()[i]);
  }
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(most_iterations, watch), &problem, &summary);
  return summary;
}

}  // namespace

void descend(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, int start,
             const std::vector<bool>& held, const Linearisation* linearisation, bool rough, Fit& fit) {
  ActiveSet active(parameters, held);
  if (active.moving().empty()) throw InputError("every parameter is held: nothing to fit");
  if (std::none_of(fit.mask.begin(), fit.mask.end(), [](const auto& used) { return used.any(); }))
    throw NumericalFailure("no point of a scan lies over the skin as the model has it: nothing to fit to");
  ChainCost cost(evaluator, parameters, options, fit.mask, fit, start);
  cost.warm_start(fit.u, fit.prediction, linearisation);
  Watch watch(cost, active, rough ? rough_sd : settled_sd);
  Eigen::VectorXd u = fit.u;
  int left = options.max_iterations;
  // A round ends at a bound or settled; each coordinate comes and goes once, then it is given up.
  for (Eigen::Index round = 0; round < 2 * parameters.size() + 2; ++round) {
    const ceres::Solver::Summary summary = solve(cost, parameters, active, watch, left, u);
    assert(cost.accepted().jacobian.size() > 0);  // the start is in range and its prediction known
    u = cost.accepted().u;
    left -= std::max(0, static_cast<int>(summary.iterations.size()) - 1);
    fit.converged = watch.settled() || summary.termination_type == ceres::CONVERGENCE;
    fit.message = watch.settled() ? "settled" : summary.message;
    if (watch.bound_met()) {
      // Nothing left to move: as settled as it can be, unless a bound lets go.
      if (!active.moving().empty() && left > 0) continue;
      fit.converged = active.moving().empty();
      fit.message = fit.converged ? "settled with every parameter at its bound" : "out of iterations";
    }
    if (left <= 0 || !active.let_go(cost.accepted(), watch.worth())) break;
  }
  const State& state = cost.accepted();
  fit.u = state.u;
  fit.prediction = state.prediction;
  fit.residuals = state.residuals;
  fit.linearisation = state.linearisation;
  fit.cost = state.cost;
  fit.iterations += options.max_iterations - left;
}

}  // namespace supine::calibration
