// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/least_squares.h"
#include "diagnosis/evidence/nuisances.h"

namespace supine::diagnosis {

struct BaseFit;

/// RMS distance of the points of skin beyond which closest points are other ones: of a body as slender as a bar they
/// may lie on its wrong side.
inline constexpr double lost_mm = 5;

/// A model and all that is never known, fitted together.
struct JointFit {
  std::optional<calibration::FreeParameters> parameters;  ///< of the model without nuisances: where its priors stand
  simulation::Model model;                                ///< at the optimum, nuisances at their values
  calibration::Fit fit;                                   ///< of it
  std::vector<Nuisance> nuisances;                        ///< at the optimum
  double size_mm = 0;                                     ///< s of the discrepancy that is likeliest
  int evaluations = 0;
  int steps = 0;    ///< that lowered F
  int dearest = 0;  ///< work of the dearest solve of those that were of use (ChainSolution::dearest_solve)
  bool keeps_history = false;
  std::vector<calibration::FitEvaluation> history;  ///< every trial, where it is kept
};

/// Where a step would lead: coordinates of the free parameters, and nuisances at their values.
struct JointTrial {
  Eigen::VectorXd u;
  std::vector<Nuisance> nuisances;
};

/// The shapes that a trial is likely to have, to first order from a fit with these nuisances, slopes and all.
simulation::ChainSolution expected_at(const JointTrial& trial, const calibration::Fit& from,
                                      const std::vector<Nuisance>& nuisances);

/// Gauss–Newton in the free parameters and the nuisances of a model, under the errors of a base fit: distances are
/// exact at every step, the discrepancy is linear.
class JointFitter {
 public:
  /// @param fit     its parameters, nuisances and mask are set; the mask may be empty: the points over the skin then
  /// @param ground  whose clusters and errors count; may be @p fit itself
  JointFitter(calibration::Evaluator& evaluator, JointFit& fit, const BaseFit& ground);

  const std::vector<std::string>& poses() const { return poses_; }

  /// Takes the fit to a trial. The first of all, where it is more than lost_mm off, also tries other moduli, 0.25 to 4
  /// times as stiff (work_limit.h), and takes the nearest: closest points of a slender body may lie on its wrong side.
  /// @throws NumericalFailure  no equilibrium there; the fit is then at neither place
  void predict(const JointTrial& at, const simulation::ChainSolution* near);
  /// Slopes of parameters and nuisances at the prediction.
  std::unique_ptr<simulation::Sensitivities> linearise();
  /// One step, shortened until F falls or a trial costs no more than it may (work_limit.h); the next begins as short,
  /// and is longer again once that did at once. @return  whether F fell by more than a little
  bool improve();
  /// Steps until none gains any more; slopes are those of the end.
  void descend(int most_steps, const std::function<void()>& before_step = {});
  /// F: distances under errors and discrepancy, priors of parameters and nuisances.
  double objective() const;

 private:
  double objective_of(const Eigen::VectorXd& distances, const JointTrial& at) const;
  JointTrial stepped(const Eigen::VectorXd& step) const;

  calibration::Evaluator& evaluator_;
  JointFit& fit_;
  const BaseFit& ground_;
  std::vector<std::string> poses_;
  double share_ = 1;  // of a step, that the next trial begins with
};

}  // namespace supine::diagnosis
