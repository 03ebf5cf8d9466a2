// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <ceres/cost_function.h>

#include "calibration/least_squares.h"

namespace supine::calibration {

/// Ceres' view of one chain run: weighted robust distances and priors, with their Jacobian; a block per parameter. Used
/// by bounded_descent.cpp.
///
/// Ceres asks for a Jacobian at accepted points only (with a line search that interpolates values alone), so the
/// solution found there is the one the next trials start from. Asked again for the accepted point it runs nothing.
class ChainCost : public ceres::CostFunction {
 public:
  /// @param mask  the points that take part
  ChainCost(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, PointMask mask, Fit& log,
            int start);

  /// Begins at a known prediction instead of an unloaded shape.
  void warm_start(const Eigen::VectorXd& u, const Prediction& prediction, const Linearisation* linearisation);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  /// State at the last accepted point.
  struct State {
    Eigen::VectorXd u;
    Prediction prediction;
    Residuals residuals;
    Linearisation linearisation;
    double cost = 0;              ///< half the sum of squares of what Ceres sees
    Eigen::MatrixXd jacobian;     ///< of what Ceres sees; empty before the first point was accepted
    Eigen::VectorXd gradient;     ///< of the cost
    Eigen::MatrixXd information;  ///< JᵀJ
  };
  const State& accepted() const { return accepted_; }

 private:
  bool predict(const Eigen::VectorXd& u) const;
  bool too_far(const Eigen::VectorXd& u) const;
  void note(const Eigen::VectorXd& u, bool failed) const;
  Eigen::VectorXd weighted(const State& state) const;
  void accept(const Eigen::VectorXd& residuals) const;

  Evaluator& evaluator_;
  const FreeParameters& parameters_;
  const FitOptions& options_;
  PointMask mask_;
  Fit& log_;
  int start_;
  mutable State accepted_, trial_;
  mutable double best_rms_mm_;
};

}  // namespace supine::calibration
