// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "calibration/least_squares.h"

namespace supine::calibration {

/// What a descent minimises: half the sum of squares of weighted robust distances and priors, with its slopes. Trials
/// start from the accepted point, moved along its slopes. Used by bounded_descent.cpp.
class ChainCost {
 public:
  /// @param mask  the points that take part
  ChainCost(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, PointMask mask, Fit& log,
            int start);

  /// Begins at a known prediction instead of an unloaded shape.
  void warm_start(const Eigen::VectorXd& u, const Prediction& prediction, const Linearisation* linearisation);

  /// Runs the chain at @p u. @return its cost; none where no equilibrium is found, or not for three times what the
  /// dearest solve of accepted runs has cost
  std::optional<double> attempt(const Eigen::VectorXd& u);
  /// Makes the last attempt the accepted point, with its slopes.
  void accept();

  /// State at the last accepted point.
  struct State {
    Eigen::VectorXd u;
    Prediction prediction;
    Residuals residuals;
    Linearisation linearisation;
    Eigen::VectorXd own;              ///< rows of FitOptions::own
    Eigen::MatrixXd own_information;  ///< JᵀJ of them; empty where there are none
    double cost = 0;
    Eigen::VectorXd gradient;     ///< of the cost; empty before the first point was accepted
    Eigen::MatrixXd information;  ///< JᵀJ
    Eigen::Index rows = 0;        ///< of J
  };
  const State& accepted() const { return accepted_; }

 private:
  void note(const Eigen::VectorXd& u, bool failed);
  Eigen::VectorXd weighted(const State& state) const;
  void linearise_trial();
  Eigen::VectorXd own_rows(const Prediction& prediction) const;
  Eigen::MatrixXd own_slopes(const State& state) const;

  Evaluator& evaluator_;
  const FreeParameters& parameters_;
  const FitOptions& options_;
  PointMask mask_;
  Fit& log_;
  int start_;
  Eigen::Index rows_;
  State accepted_, trial_;
  double best_rms_mm_;
  int dearest_ = 0;  // ChainSolution::dearest_solve of an accepted run
};

}  // namespace supine::calibration
