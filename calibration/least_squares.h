// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "calibration/own_residual.h"
#include "calibration/residuals.h"

namespace supine::calibration {

/// How a fit is going, told at every evaluation.
struct FitProgress {
  int evaluations, failed;  ///< chain runs so far, and those without equilibrium
  double rms_mm;            ///< of this evaluation; NaN when it failed
  double best_rms_mm;
  bool outside_tissue = false;  ///< a modulus of this evaluation is none that tissue has (tissue_range.h)
};

struct FitOptions {
  double robust_mm = 5;          ///< beyond this a point counts linearly instead of quadratically, > 0
  bool use_priors = true;        ///< where the model gives prior_sd
  int max_iterations = 50;       ///< of one descent, > 0
  int starts = 1;                ///< descents: from the model's values, then from seeded draws around them, > 0
  unsigned seed = 1;             ///< of the draws
  std::vector<double> noise_mm;  ///< per measurement, > 0
  const simulation::ChainSolution* near = nullptr;   ///< solution of the model's values, where it is known
  std::function<void(const FitProgress&)> progress;  ///< may be empty
  std::vector<const OwnResidual*> own = {};          ///< that count beside the distances

  void check(const MeasuredScene& scene) const;  ///< @throws InputError  naming the option, its value and the bound
};

/// One evaluation, for the history.
struct FitEvaluation {
  Eigen::VectorXd values;               ///< of the parameters
  double mae_study_mm, mae_mm, rms_mm;  ///< NaN when it failed
  bool failed, accepted;
  int start;  ///< which descent, from 0
};

/// A calibrated model and what is needed to judge it.
struct Fit {
  Eigen::VectorXd u;  ///< coordinates of FreeParameters
  Prediction prediction;
  PointMask mask;
  Residuals residuals;
  Linearisation linearisation;
  Eigen::MatrixXd own_information;  ///< JᵀJ of FitOptions::own; empty where there is none
  Eigen::MatrixXd information;      ///< JᵀJ of all that the cost holds, priors too; empty where nothing was minimised
  double cost = 0;  ///< half the sum of squares of the weighted, robust residuals, own ones and the priors
  bool converged = false;
  std::string message;
  int iterations = 0, evaluations = 0, failed = 0;
  std::vector<FitEvaluation> history;
  std::vector<double> start_costs;  ///< final cost of every descent; NaN where the start had no equilibrium
};

/// Bounded nonlinear least squares (bounded_descent.h) on the signed distances scan → model, with exact sensitivities:
///   min ½ Σ g(d_i)²/σ_i² + ½ Σ (u_j − m_j)²/s_j² + ½ ‖own‖²,   ½ g(d)² = δ² (√(1 + (d/δ)²) − 1)   (pseudo-Huber, δ =
///   robust_mm).
/// Which scan points take part is decided at the start of a descent and again at its end, until 99 % of them stay.
/// A trial without equilibrium, or that takes too long to find one, is a rejected step. Each run starts at the last
/// accepted shape, moved along the sensitivities.
/// @throws NumericalFailure  no equilibrium, or no scan point over the skin, at any start
Fit fit_least_squares(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options);

/// The same for a fixed set of points and some coordinates held: for profiles. The history is left empty.
/// @param from  the fit to start from
/// @param held  per coordinate, whether it stays at its value in @p u
Fit refit(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, const Fit& from,
          const Eigen::VectorXd& u, const std::vector<bool>& held);

/// A Fit at given coordinates without searching: for the answer of another method.
Fit evaluate_fit(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options,
                 const Eigen::VectorXd& u);

/// g(d) and g'(d) of fit_least_squares().
double robust_residual(double d, double robust_mm);
double robust_slope(double d, double robust_mm);

}  // namespace supine::calibration
