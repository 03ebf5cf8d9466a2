// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/intervals.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/statistics.h"
#include "diagnosis/diagnose.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;

constexpr int trials = 3;  // values tried on each side
constexpr double near_enough = 0.2;

/// Sources and whitening without the tolerance for the effect, the mesh's error at the model with it.
struct Errors {
  ErrorSources sources;
  Whitening whitening;
};

Errors errors_with(const calibration::MeasuredScene& scene, const ErrorSources& sources, const NumericalError* base,
                   const Tolerances& tolerances, const Refit& refit) {
  Errors errors{without_tolerance_for(refit.effect, sources), {}};
  if (base != nullptr) {
    try {
      set_numerical(measure_numerical_error(scene, refit.model, refit.fit.solution, base), tolerances, errors.sources);
    } catch (const NumericalFailure&) {
      // No other mesh carries this model: what was measured without the effect has to do.
    }
  }
  errors.whitening = Whitening::of(refit.fit.solution.residuals, errors.sources);
  return errors;
}

/// The interval widened by an error of @p sd of the value, in quadrature on each side, cut at the range.
void widen(double sd, FittedParameter& p) {
  const double more = normal_reach95() * sd;
  const simulation::Parameter& row = *simulation::find_parameter(p.name);
  p.low = std::max(row.lower, p.value - std::hypot(p.value - p.low, more));
  p.high = std::min(row.upper, p.value + std::hypot(p.high - p.value, more));
}

/// F above its least when one parameter, which has no prior, is held and the others are fitted again.
class Profile {
 public:
  Profile(const calibration::MeasuredScene& scene, const Metric& metric, const FreeParameters& parameters,
          const WeightedFit& least, Eigen::Index which)
      : scene_(scene), metric_(metric), parameters_(parameters), least_(least), which_(which) {
    const Eigen::MatrixXd h = information(least, parameters, metric);
    others_ = Eigen::VectorXd::Zero(parameters.size());
    std::vector<int> rest;
    for (int i = 0; i < static_cast<int>(parameters.size()); ++i)
      if (i != which) rest.push_back(i);
    if (!rest.empty())
      others_(rest) = -h(rest, rest).completeOrthogonalDecomposition().solve(h(rest, std::vector<int>{int(which)}));
  }

  /// @return infinity where there is no equilibrium
  double rise(double step) const {
    Eigen::VectorXd u = least_.solution.u + step * others_;
    u[which_] = least_.solution.u[which_] + step;
    u = parameters_.clamped(u);
    const FreeParameters rest = with_one_held(u[which_]);
    Eigen::VectorXd start(rest.size());
    for (Eigen::Index i = 0; i < start.size(); ++i) start[i] = u[i < which_ ? i : i + 1];
    try {
      calibration::Evaluator evaluator(scene_, rest.base(), accurate_enough());
      WeightedFit fit = weigh(evaluator, rest, metric_, start, &least_.solution.prediction.solution);
      DescentOptions few;
      few.max_iterations = 2;
      descend(evaluator, rest, metric_, few, fit);
      return fit.objective - least_.objective;
    } catch (const NumericalFailure&) {
      return std::numeric_limits<double>::infinity();
    }
  }

 private:
  /// The others free, with the priors they have.
  FreeParameters with_one_held(double coordinate) const {
    const std::string& name = parameters_.names()[static_cast<std::size_t>(which_)];
    simulation::Model model = parameters_.base();
    simulation::Setting& held = *simulation::find_setting(model, name);
    held.value = parameters_.value(which_, coordinate), held.free = false;
    std::vector<std::string> rest = parameters_.names();
    rest.erase(rest.begin() + which_);
    return FreeParameters(std::move(model), std::move(rest));
  }

  const calibration::MeasuredScene& scene_;
  const Metric& metric_;
  const FreeParameters& parameters_;
  const WeightedFit& least_;
  Eigen::Index which_;
  Eigen::VectorXd others_;  // how they follow, per unit of the one
};

/// Step at which the rise is @p height, looked for from @p reach (signed) on, no further than @p farthest.
double crossing(const Profile& profile, double reach, double farthest, double height) {
  const auto cut = [farthest](double step) { return std::abs(step) > std::abs(farthest) ? farthest : step; };
  double step = cut(reach), below = 0, above = 0;
  for (int trial = 0; trial < trials && std::abs(step) > 1e-9; ++trial) {
    const double rise = profile.rise(step);
    if (std::abs(rise / height - 1) < near_enough) return cut(step * std::sqrt(height / rise));
    (rise < height ? below : above) = step;
    if (rise < height && step == farthest) return farthest;
    // As if F were a parabola, but within what is known of the sides.
    const double guess = step * std::clamp(std::sqrt(height / std::max(rise, 1e-3 * height)), 0.4, 3.0);
    const bool both = above != 0;
    step = both && (std::abs(guess) >= std::abs(above) || std::abs(guess) <= std::abs(below)) ? 0.5 * (below + above)
                                                                                              : cut(guess);
  }
  return step;
}

FittedParameter profiled(const calibration::MeasuredScene& scene, const Metric& metric,
                         const FreeParameters& parameters, const WeightedFit& least, Eigen::Index i,
                         const FittedParameter& linear) {
  const Profile profile(scene, metric, parameters, least, i);
  const double u = least.solution.u[i];
  const double height = chi_squared_quantile(1, 0.95) * std::max(1.0, misfit_of(least, parameters, metric));
  const double variance = covariance_of(information(least, parameters, metric))(i, i);
  const double reach = std::sqrt(height * variance);
  FittedParameter result = linear;
  double ends[2] = {-reach, reach};
  const double farthest[2] = {parameters.lower()[i] - u, parameters.upper()[i] - u};
#pragma omp parallel for schedule(static, 1)
  for (int side = 0; side < 2; ++side) ends[side] = crossing(profile, ends[side], farthest[side], height);
  result.low = parameters.value(i, u + ends[0]);
  result.high = parameters.value(i, u + ends[1]);
  return result;
}

}  // namespace

void settle(const calibration::MeasuredScene& scene, const ErrorSources& sources, const NumericalError* numerical,
            const Tolerances& tolerances, const Metric& metric, Refit& refit) {
  const Errors errors = errors_with(scene, sources, numerical, tolerances, refit);
  Metric now = metric;
  now.whitening = &errors.whitening, now.mean_mm = errors.sources.mean_mm;
  const FreeParameters parameters(refit.given);
  WeightedFit fit = refit.fit;
  calibration::Evaluator evaluator(scene, refit.model, accurate_enough());
  weigh_again(parameters, now, fit);
  descend(evaluator, parameters, now, DescentOptions{}, fit);
  refit.parameters = linear_intervals(refit.effect, fit, parameters, now);
  std::vector<Eigen::Index> strengths;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (parameters.names()[k].rfind(refit.effect + ".", 0) == 0 && !parameters.priors()[k]) strengths.push_back(i);
  }
  for (FittedParameter& p : refit.parameters) {
    for (const Eigen::Index i : strengths)
      if (strengths.size() == 1 && p.name == parameters.names()[static_cast<std::size_t>(i)])
        p = profiled(scene, now, parameters, fit, i, p);
    const double size = std::abs(p.value - simulation::find_parameter(p.name)->null);
    const double form = simulation::is_measurement_effect(refit.effect) ? 0 : tolerances.effect_form * size;
    widen(std::hypot(form, tolerance_for(refit.effect, p.unit, tolerances)), p);
  }
}

}  // namespace supine::diagnosis
