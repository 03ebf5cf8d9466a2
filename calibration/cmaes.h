// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "calibration/evaluator_pool.h"
#include "calibration/least_squares.h"

namespace supine::calibration {

/// Runs of a generation, pagmo's bound.
inline constexpr int least_population = 5;

struct CmaesOptions {
  unsigned seed = 1;
  int population = 0;         ///< runs per generation, at least least_population; 0 = the larger of 6 and 4 + 3 ln n
  int max_evaluations = 300;  ///< > 0
  std::optional<double> until_mae_mm;  ///< stop as soon as a generation holds a run at or under it
  double flat_mm = 1e-3;  ///< stop when three generations have spread by less and the best has not improved by more
  std::function<void(int evaluations, int failed, double best_mae_mm)> progress;  ///< may be empty

  void check() const;  ///< @throws InputError  naming the option, its value and the bound
};

struct CmaesResult {
  Eigen::VectorXd values;  ///< of the best run
  double mae_study_mm = 0;
  int evaluations = 0, failed = 0, generations = 0;
  bool target_met = false;
  std::string message;                 ///< why it stopped
  std::vector<FitEvaluation> history;  ///< every run in order; `start` is its generation, `accepted` a new best
};

/// The study's calibration: CMA-ES (Hansen; pagmo) on the MAE model skin → scan, gradient-free.
///
/// Per parameter the first mean is its value in the model and σ its prior_sd (a sixth of the range where it has none),
/// in the parameter's own unit, as in the study. A draw outside the range is run at its end and pays 1 mm per squared
/// σ it lies outside; a draw without equilibrium comes last. The draws of a generation are run side by side: pagmo
/// evaluates them one after the other, so a copy of the algorithm is asked for them first and the original is then
/// answered from the table. pagmo takes the best of the first population for its mean and the width of the box times
/// sigma0 for its spread; hence a population of copies of the start in a box of equal sides.
/// @throws NumericalFailure  no run had an equilibrium
CmaesResult minimise_cmaes(EvaluatorPool& pool, const FreeParameters& parameters, const CmaesOptions& options,
                           RunJournal& journal);

}  // namespace supine::calibration
