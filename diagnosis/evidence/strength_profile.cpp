// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/strength_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/first_failure.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double stride = 1.5;    // standard deviations between two places
constexpr double fallen = 4;      // of ln, from the highest: no further place
constexpr int most_per_side = 5;  // places
// Of F: a step that promises less stays on the lines, and what it promises counts in the evidence without being taken.
constexpr double bend = 2;
constexpr double bent = 0.5;  // of what the usual size changes, that the slope does not say

struct Place {
  double u, ln_density;
  VectorXd others;        ///< coordinates of the other free parameters, where they are likeliest
  calibration::Fit held;  ///< of them, close to there
};

/// How a walk to one side ended.
enum class End { fell, range, no_body, open };

struct Side {
  std::vector<Place> places;  ///< the nearest first; without what is held there
  End end = End::open;
};

/// Shapes on the line through two places, @p share of their distance beyond the last.
simulation::ChainSolution beyond(const simulation::ChainSolution& before, simulation::ChainSolution last,
                                 double share) {
  last.X += share * (last.X - before.X);
  last.prone += share * (last.prone - before.prone);
  for (std::size_t p = 0; p < last.poses.size(); ++p) last.poses[p].x += share * (last.poses[p].x - before.poses[p].x);
  return last;
}

double ln_normal(double u, const calibration::Prior& prior) {
  const double z = (u - prior.mean) / prior.sd;
  return -0.5 * z * z - std::log(prior.sd * std::sqrt(2 * std::numbers::pi));
}

/// The likeliest offsets of the first @p count numbers.
VectorXd likeliest(const Weighed& weighed, Index count) { return weighed.mean[weighed.likeliest()].head(count); }

class Walker {
 public:
  Walker(const RefitGround& ground, const Refit& refit, const FreeParameters& parameters, Index k)
      : ground_(ground), refit_(refit), parameters_(parameters), k_(k), prior_(*parameters.priors()[index()]) {}

  /// Where the refit stands: its slopes are known.
  Place start() const {
    const Hypothesis& h = refit_.hypothesis;
    std::vector<int> rows = h.rows;
    rows.erase(rows.begin() + k_);
    const Weighed weighed = h.evidence->weigh(rows);
    const double u = refit_.joint.fit.u[k_];
    const VectorXd others = without(refit_.joint.fit.u);
    calibration::Fit held;
    held.u = others;
    held.prediction.solution = refit_.joint.fit.prediction.solution;
    return {u, weighed.ln_evidence + ln_normal(u, prior_), others + likeliest(weighed, others.size()), std::move(held)};
  }

  /// Places to one side.
  Side walk(const Place& from, double step) const {
    Side side;
    Place before = from, last = from;
    double most = from.ln_density;
    for (int count = 0; count < most_per_side; ++count) {
      const double u = std::clamp(last.u + step, parameters_.lower()[k_], parameters_.upper()[k_]);
      if (std::abs(u - last.u) < 0.1 * std::abs(step)) return ended(End::range, side);
      try {
        const VectorXd others = count == 0 ? last.others : VectorXd(2 * last.others - before.others);
        Place next = place(u, others, count == 0 ? from_refit(u, others) : from_two(before, last, u, others));
        before = std::move(last), last = std::move(next);
      } catch (const NumericalFailure&) {
        return ended(End::no_body, side);
      }
      most = std::max(most, last.ln_density);
      side.places.push_back({last.u, last.ln_density, {}, {}});
      if (last.ln_density <= most - fallen) return ended(End::fell, side);
    }
    const double bound = step < 0 ? parameters_.lower()[k_] : parameters_.upper()[k_];
    for (const auto& [u, ln] : prior_alone(last.u, last.ln_density, step, bound, prior_))
      side.places.push_back({u, ln, {}, {}});
    return side;
  }

 private:
  static Side ended(End end, Side& side) {
    side.end = end;
    return std::move(side);
  }

  std::size_t index() const { return static_cast<std::size_t>(k_); }

  VectorXd without(const VectorXd& u) const {
    VectorXd others(u.size() - 1);
    others << u.head(k_), u.tail(u.size() - k_ - 1);
    return others;
  }

  /// Shapes to start from, along the slopes of the refit.
  simulation::ChainSolution from_refit(double u, const VectorXd& others) const {
    const calibration::Fit& fit = refit_.joint.fit;
    VectorXd step(fit.u.size());
    step << others.head(k_), u, others.tail(others.size() - k_);
    return calibration::extrapolated(fit.prediction.solution, fit.linearisation.by_coordinate, step - fit.u);
  }

  /// The same through two places, and from there along the slopes of the last.
  static simulation::ChainSolution from_two(const Place& before, const Place& last, double u, const VectorXd& others) {
    const double share = (u - last.u) / (last.u - before.u);
    const VectorXd there = last.held.u + share * (last.held.u - before.held.u);
    return calibration::extrapolated(beyond(before.held.prediction.solution, last.held.prediction.solution, share),
                                     last.held.linearisation.by_coordinate, others - there);
  }

  /// @param near  shapes to start from
  Place place(double u, const VectorXd& others, const simulation::ChainSolution& near) const {
    simulation::Model model = parameters_.base();
    simulation::Setting& setting = *simulation::find_setting(model, parameters_.names()[index()]);
    setting.value = parameters_.value(k_, u);
    setting.free = false;
    const FreeParameters rest(model);
    calibration::Evaluator evaluator(ground_.scene, rest.base(), accurate_enough());
    WeightedFit fit = weigh(evaluator, rest, ground_.metric, rest.clamped(others), &near);
    descend(evaluator, rest, ground_.metric, {.max_iterations = 2, .settled = bend}, fit);
    const LinearEvidence evidence(*ground_.base.covariance, ground_.base.distances(fit.solution.residuals),
                                  directions_at(fit.solution, rest, ground_.nuisances, ground_.base.clusters));
    const Weighed weighed = evidence.weigh_all();
    const VectorXd there = fit.solution.u + likeliest(weighed, others.size());
    return {u, weighed.ln_evidence + ln_normal(u, prior_), there, std::move(fit.solution)};
  }

  const RefitGround& ground_;
  const Refit& refit_;
  const FreeParameters& parameters_;
  Index k_;
  calibration::Prior prior_;
};

}  // namespace

bool is_far_from_linear(const Candidate& candidate) {
  if (candidate.secant.size() == 0) return false;
  const VectorXd promised = candidate.parameters[0].typical * candidate.slope.col(0);
  return (promised - candidate.secant).norm() > bent * candidate.secant.norm();
}

std::vector<std::pair<double, double>> prior_alone(double last, double ln_density, double step, double bound,
                                                   const calibration::Prior& prior) {
  constexpr double furthest = 4, least = 0.5;  // standard deviations of the prior
  const double along = std::copysign(std::max(std::abs(step), least * prior.sd), step);
  std::vector<std::pair<double, double>> places;
  for (double u = last + along; (bound - u) * step > 0; u += along) {
    places.emplace_back(u, ln_density + ln_normal(u, prior) - ln_normal(last, prior));
    if ((u - prior.mean) * std::copysign(1.0, step) > furthest * prior.sd) break;
  }
  return places;
}

std::optional<CurvedDensity> strength_profile(const RefitGround& ground, const Refit& refit,
                                              const FreeParameters& parameters, Index k) {
  const double sd = refit.hypothesis.weighed.number(k).second;
  const Walker walker(ground, refit, parameters, k);
  const Place middle = walker.start();
  std::array<Side, 2> sides;
  FirstFailure failure;
#pragma omp parallel for schedule(static, 1)
  for (std::size_t side = 0; side < 2; ++side)
    failure.guard([&] { sides[side] = walker.walk(middle, (side == 0 ? -stride : stride) * sd); });
  failure.rethrow();
  std::vector<double> at, ln;
  const auto add = [&](const Place& place) { at.push_back(place.u), ln.push_back(place.ln_density); };
  std::for_each(sides[0].places.rbegin(), sides[0].places.rend(), add);
  add(middle);
  std::for_each(sides[1].places.begin(), sides[1].places.end(), add);
  if (at.size() < 4) return std::nullopt;
  const double lower = sides[0].end == End::no_body ? at.front() : parameters.lower()[k];
  const double upper = sides[1].end == End::no_body ? at.back() : parameters.upper()[k];
  return CurvedDensity(std::move(at), std::move(ln), lower, upper);
}

}  // namespace supine::diagnosis
