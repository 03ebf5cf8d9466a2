// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/bounded_descent.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "calibration/chain_cost.h"
#include "common/error.h"

namespace supine::calibration {
namespace {

using State = ChainCost::State;

constexpr double settled_sd = 0.05, rough_sd = 0.1;
// Half the trust region, in ln(value); coordinates that are no logarithm have the scale of a prior or a typical size.
constexpr double largest_radius = 1.5, linear_share = 4;
constexpr double poor_ratio = 0.25, good_ratio = 0.75;  // of what the cost fell to what the step promised
constexpr double after_poor = 0.5, after_failure = 0.25, after_good = 2;
constexpr double least_ratio = 1e-4;    // a step that brings less is not taken
constexpr double shortest_step = 1e-3;  // distances have kinks: there the cost falls along no step
constexpr double shortest_failure = 0.01;
constexpr double least_curvature = 1e-12;  // share of the largest: what moves nothing has a step all the same

/// Where steps may end.
struct Box {
  Eigen::VectorXd lower, upper;
};

/// The range of the parameters around @p u; held ones stay.
Box range_around(const FreeParameters& parameters, const std::vector<bool>& held, const Eigen::VectorXd& u) {
  Box box{parameters.lower() - u, parameters.upper() - u};
  for (std::size_t i = 0; i < held.size(); ++i)
    if (held[i]) box.lower[static_cast<Eigen::Index>(i)] = box.upper[static_cast<Eigen::Index>(i)] = 0;
  box.lower = box.lower.cwiseMin(0);
  box.upper = box.upper.cwiseMax(0);
  return box;
}

Eigen::VectorXd reaches(const FreeParameters& parameters) {
  Eigen::VectorXd reach(parameters.size());
  for (Eigen::Index i = 0; i < reach.size(); ++i) reach[i] = parameters.is_log(i) ? 1 : linear_share;
  return reach;
}

/// What a step takes off the cost if residuals change along their slopes.
double promise(const State& state, const Eigen::VectorXd& step) {
  return -(state.gradient.dot(step) + 0.5 * step.dot(state.information * step));
}

/// The fall of the cost that is worth a chain run.
double worth(const State& state, double step_sd) {
  const double mean_square = 2 * state.cost / static_cast<double>(state.rows);
  return 0.5 * step_sd * step_sd * std::max(1.0, mean_square);
}

/// @p u moved by the step; on the end of its range exactly where the step leads there.
Eigen::VectorXd moved(const FreeParameters& parameters, const Eigen::VectorXd& u, const Eigen::VectorXd& step,
                      const Box& range) {
  Eigen::VectorXd to = u + step;
  for (Eigen::Index i = 0; i < to.size(); ++i) {
    if (step[i] != 0 && step[i] <= range.lower[i]) to[i] = parameters.lower()[i];
    if (step[i] != 0 && step[i] >= range.upper[i]) to[i] = parameters.upper()[i];
  }
  return parameters.clamped(to);
}

std::string values_of(const FreeParameters& parameters, const Eigen::VectorXd& u) {
  std::string text;
  for (Eigen::Index i = 0; i < u.size(); ++i)
    text += fmt::format("{}{} = {:.3g} {}", i > 0 ? ", " : "", parameters.names()[static_cast<std::size_t>(i)],
                        parameters.value(i, u[i]), parameters.unit(i));
  return text;
}

/// The trust region: half its width, and what the last step says of it.
class TrustRegion {
 public:
  explicit TrustRegion(const FreeParameters& parameters) : reach_(reaches(parameters)) {}

  Box within(const Box& range) const {
    return {range.lower.cwiseMax(-radius_ * reach_), range.upper.cwiseMin(radius_ * reach_)};
  }
  double size(const Eigen::VectorXd& step) const { return step.cwiseQuotient(reach_).cwiseAbs().maxCoeff(); }

  void after(const Eigen::VectorXd& step, double ratio) {
    const double length = size(step);
    if (ratio < poor_ratio)
      radius_ = after_poor * length;
    else if (ratio > good_ratio && length > 0.99 * radius_)
      radius_ = std::min(after_good * radius_, largest_radius);
  }
  void after_no_equilibrium(const Eigen::VectorXd& step) { radius_ = after_failure * size(step); }

 private:
  Eigen::VectorXd reach_;
  double radius_ = largest_radius;
};

/// Goes down until it has settled or finds no way. Notes in @p fit how it ended; returns the steps it took.
int go_down(ChainCost& cost, const FreeParameters& parameters, const std::vector<bool>& held, double step_sd, int most,
            Fit& fit) {
  TrustRegion trust(parameters);
  const auto ended = [&fit](bool converged, std::string message) {
    fit.converged = converged;
    fit.message = std::move(message);
  };
  for (int taken = 0; taken < most; ++taken) {
    const State& state = cost.accepted();
    const Box range = range_around(parameters, held, state.u);
    const Eigen::VectorXd whole = box_step(state.information, state.gradient, range.lower, range.upper);
    if (promise(state, whole) < worth(state, step_sd)) return ended(true, "settled"), taken;
    const Box box = trust.within(range);
    const Eigen::VectorXd step = box_step(state.information, state.gradient, box.lower, box.upper);
    const double promised = promise(state, step), before = state.cost, length = trust.size(step);
    const Eigen::VectorXd to = moved(parameters, state.u, step, range);
    const std::optional<double> reached = cost.attempt(to);
    if (!reached) {
      if (length < shortest_failure)
        return ended(false, fmt::format("the error falls toward {}, where no equilibrium was found",
                                        values_of(parameters, to))),
               taken + 1;
      trust.after_no_equilibrium(step);
      continue;
    }
    const double ratio = (before - *reached) / promised;
    if (ratio > least_ratio)
      cost.accept();
    else if (length < shortest_step)
      return ended(true, "no shorter step lowers the error"), taken + 1;
    trust.after(step, ratio);
  }
  ended(false, fmt::format("out of iterations ({})", most));
  return most;
}

}  // namespace

Eigen::VectorXd box_step(const Eigen::MatrixXd& a, const Eigen::VectorXd& g, const Eigen::VectorXd& lower,
                         const Eigen::VectorXd& upper) {
  const Eigen::Index n = g.size();
  Eigen::MatrixXd h = a;
  h.diagonal().array() += least_curvature * std::max(a.diagonal().maxCoeff(), 1e-300);
  Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
  std::vector<bool> held(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i)
    held[static_cast<std::size_t>(i)] = (lower[i] >= 0 && g[i] >= 0) || (upper[i] <= 0 && g[i] <= 0);
  // Every round holds a coordinate more, or lets one go after a fall: it ends by itself.
  for (Eigen::Index round = 0; round < 8 * n + 8; ++round) {
    std::vector<int> free;
    for (Eigen::Index i = 0; i < n; ++i)
      if (!held[static_cast<std::size_t>(i)]) free.push_back(static_cast<int>(i));
    const Eigen::VectorXd gradient = g + h * s;
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    if (!free.empty()) {
      const Eigen::VectorXd part = -h(free, free).ldlt().solve(gradient(free));
      for (std::size_t k = 0; k < free.size(); ++k) step[free[k]] = part[static_cast<Eigen::Index>(k)];
    }
    double share = 1;
    int blocking = -1;
    for (const int i : free) {
      const double room = step[i] > 0 ? upper[i] - s[i] : lower[i] - s[i];
      if (std::abs(step[i]) * share > std::abs(room)) share = std::abs(room / step[i]), blocking = i;
    }
    s += share * step;
    if (blocking >= 0) {
      s[blocking] = step[blocking] > 0 ? upper[blocking] : lower[blocking];
      held[static_cast<std::size_t>(blocking)] = true;
      continue;
    }
    const Eigen::VectorXd left = g + h * s;
    Eigen::Index let_go = -1;
    double most = 1e-10 * g.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < n; ++i) {
      const bool inward =
          (s[i] <= lower[i] && left[i] < 0 && upper[i] > s[i]) || (s[i] >= upper[i] && left[i] > 0 && lower[i] < s[i]);
      if (held[static_cast<std::size_t>(i)] && inward && std::abs(left[i]) > most) let_go = i, most = std::abs(left[i]);
    }
    if (let_go < 0) break;
    held[static_cast<std::size_t>(let_go)] = false;
  }
  return s.cwiseMax(lower).cwiseMin(upper);
}

void descend(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, int start,
             const std::vector<bool>& held, const Linearisation* linearisation, bool rough, Fit& fit) {
  if (!held.empty() && std::all_of(held.begin(), held.end(), [](bool one) { return one; }))
    throw InputError("every parameter is held: nothing to fit");
  if (std::none_of(fit.mask.begin(), fit.mask.end(), [](const auto& used) { return used.any(); }))
    throw NumericalFailure("no point of a scan lies over the skin as the model has it: nothing to fit to");
  ChainCost cost(evaluator, parameters, options, fit.mask, fit, start);
  cost.warm_start(fit.u, fit.prediction, linearisation);
  fit.iterations += go_down(cost, parameters, held, rough ? rough_sd : settled_sd, options.max_iterations, fit);
  const State& state = cost.accepted();
  fit.u = state.u;
  fit.prediction = state.prediction;
  fit.residuals = state.residuals;
  fit.linearisation = state.linearisation;
  fit.own_information = state.own_information;
  fit.information = state.information;
  fit.cost = state.cost;
}

}  // namespace supine::calibration
