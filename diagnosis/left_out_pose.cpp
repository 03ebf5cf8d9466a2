// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/left_out_pose.h"

#include <Eigen/Dense>

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using calibration::Residuals;

Residuals part_of(const Residuals& all, const std::vector<int>& rows) {
  return {all.distance_mm(rows),   all.sigma_mm(rows), all.place(rows, Eigen::all),
          all.q(rows, Eigen::all), all.pose(rows),     all.point(rows)};
}

ErrorSources part_of(const ErrorSources& all, const std::vector<int>& rows) {
  ErrorSources part = all;
  part.noise_mm = all.noise_mm(rows);
  part.mean_mm = all.mean_mm(rows);
  if (all.share.size() > 0) part.share = all.share(rows);
  for (ErrorMode& mode : part.modes) mode.shape_mm = Eigen::VectorXd(mode.shape_mm(rows));
  return part;
}

/// The step to the least of F over some rows.
Eigen::VectorXd step_without_the_others(const calibration::Fit& fit, const FreeParameters& parameters,
                                        const ErrorSources& sources, const std::vector<int>& rows) {
  const Residuals kept = part_of(fit.residuals, rows);
  const ErrorSources errors = part_of(sources, rows);
  const Whitening whitening = Whitening::of(kept, errors);
  const Eigen::VectorXd value = whitening.apply(kept.distance_mm + errors.mean_mm);
  const Eigen::MatrixXd slope = whitening.apply(fit.linearisation.slope(rows, Eigen::all));
  Eigen::MatrixXd information = slope.transpose() * slope;
  const Eigen::VectorXd priors = parameters.prior_information();
  information.diagonal() += priors;
  const Eigen::VectorXd gradient =
      slope.transpose() * value + priors.cwiseSqrt().cwiseProduct(parameters.prior_deviation(fit.u));
  const Eigen::VectorXd step = -information.completeOrthogonalDecomposition().solve(gradient);
  return parameters.clamped(fit.u + step) - fit.u;
}

}  // namespace

std::vector<Eigen::VectorXd> left_out_poses_mm(const WeightedFit& fit, const FreeParameters& parameters,
                                               const ErrorSources& sources) {
  const Residuals& residuals = fit.solution.residuals;
  const int poses = residuals.size() > 0 ? residuals.pose.maxCoeff() + 1 : 0;
  std::vector<Eigen::VectorXd> all;
  if (poses < 2) return all;
  for (int pose = 0; pose < poses; ++pose) {
    std::vector<int> own, others;
    for (Eigen::Index r = 0; r < residuals.size(); ++r)
      (residuals.pose[r] == pose ? own : others).push_back(static_cast<int>(r));
    if (own.empty() || others.empty()) continue;
    const Eigen::VectorXd step = step_without_the_others(fit.solution, parameters, sources, others);
    all.emplace_back(residuals.distance_mm(own) + sources.mean_mm(own) +
                     fit.solution.linearisation.slope(own, Eigen::all) * step);
  }
  return all;
}

}  // namespace supine::diagnosis
