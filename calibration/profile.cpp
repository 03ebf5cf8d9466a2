// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cmath>

#include "calibration/uncertainty.h"
#include "common/error.h"
#include "common/statistics.h"

namespace supine::calibration {
namespace {

const double rise_95 = chi_squared_quantile(1, 0.95);
constexpr int most_refits = 3;        // per end
constexpr double close_enough = 0.1;  // of the distance in the square root of the rise

/// One end of one interval.
class ProfileEnd {
 public:
  ProfileEnd(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, const Fit& fit,
             const Eigen::MatrixXd& white, Eigen::Index which, int& runs)
      : evaluator_(evaluator),
        parameters_(parameters),
        options_(options),
        fit_(fit),
        white_(white),
        which_(which),
        runs_(runs),
        tau_squared_(fit.residuals.distance_mm.squaredNorm() / static_cast<double>(fit.residuals.size())) {
    held_.assign(static_cast<std::size_t>(parameters.size()), false);
    held_[static_cast<std::size_t>(which)] = true;
  }

  /// Coordinate at which the rise is @p target, looked for from @p guess; the square root of the rise is about linear
  /// in the coordinate, so the secant goes through (optimum, 0).
  double find(double guess, double target) {
    const double centre = fit_.u[which_], low = parameters_.lower()[which_], high = parameters_.upper()[which_];
    double u = std::clamp(guess, low, high);
    for (int trial = 0; trial < most_refits && u != centre; ++trial) {
      const double reached = std::sqrt(std::max(rise(u), 0.0) / target);
      if (std::abs(reached - 1) < close_enough) return u;
      const bool at_end = u == low || u == high;
      if (at_end && reached < 1) return u;  // the range ends before the interval does
      u = std::clamp(centre + (u - centre) / std::clamp(reached, 0.25, 4.0), low, high);
    }
    return u;
  }

 private:
  /// Rise of twice the cost over the optimum, in units of the residuals' mean square.
  double rise(double u) {
    Eigen::VectorXd from = fit_.u;
    // The others go along with the coordinate as the linearised fit says they do.
    from += white_.col(which_) * ((u - fit_.u[which_]) / white_(which_, which_));
    from = parameters_.clamped(from);
    from[which_] = u;
    if (parameters_.size() == 1) {
      Fit moved = fit_;
      ++runs_;
      const simulation::ChainSolution near =
          extrapolated(fit_.prediction.solution, fit_.linearisation.by_coordinate, from - fit_.u);
      moved.prediction = evaluator_.predict(parameters_.model(from), &near);
      moved.residuals = residuals_of(evaluator_.scene(), moved.prediction, fit_.mask, options_.noise_mm);
      return twice_cost(from, moved.residuals) - twice_cost(fit_.u, fit_.residuals);
    }
    const Fit refitted = refit(evaluator_, parameters_, options_, fit_, from, held_);
    runs_ += refitted.evaluations;
    return twice_cost(refitted.u, refitted.residuals) - twice_cost(fit_.u, fit_.residuals);
  }

  double twice_cost(const Eigen::VectorXd& u, const Residuals& residuals) const {
    double sum = 0;
    for (Eigen::Index i = 0; i < residuals.size(); ++i)
      sum += std::pow(robust_residual(residuals.distance_mm[i], options_.robust_mm), 2) / tau_squared_;
    return sum + (options_.use_priors ? parameters_.prior_deviation(u).squaredNorm() : 0);
  }

  Evaluator& evaluator_;
  const FreeParameters& parameters_;
  const FitOptions& options_;
  const Fit& fit_;
  const Eigen::MatrixXd& white_;
  Eigen::Index which_;
  int& runs_;
  double tau_squared_;
  std::vector<bool> held_;
};

}  // namespace

Profile profile_interval(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options,
                         const Fit& fit, const Uncertainty& uncertainty, Eigen::Index which) {
  const double sd = std::sqrt(uncertainty.covariance(which, which)), reach = std::sqrt(rise_95) * sd;
  const double target = rise_95 * uncertainty.covariance(which, which) / uncertainty.white(which, which);
  Profile profile;
  double ends[2];
  for (const int side : {0, 1}) {
    const double guess = fit.u[which] + (side == 0 ? -reach : reach);
    try {
      ends[side] =
          ProfileEnd(evaluator, parameters, options, fit, uncertainty.white, which, profile.runs).find(guess, target);
    } catch (const NumericalFailure&) {
      ends[side] = std::clamp(guess, parameters.lower()[which], parameters.upper()[which]);
    }
  }
  profile.interval = {parameters.value(which, ends[0]), parameters.value(which, ends[1])};
  return profile;
}

}  // namespace supine::calibration
