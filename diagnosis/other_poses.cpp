// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/other_poses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/rms.h"
#include "common/statistics.h"
#include "diagnosis/candidates.h"
#include "diagnosis/left_out_pose.h"
#include "simulation/catalogue.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using calibration::MeasuredScene;
using calibration::Prediction;

std::size_t fitted_poses(const WeightedFit& fit) { return fit.solution.prediction.solution.poses.size(); }

/// The fit's solution, and the poses it lacks: as far from its undeformed shape as they were in @p base, or there.
simulation::ChainSolution start_of(const MeasuredScene& whole, const WeightedFit& fit, const OtherPoses* base) {
  simulation::ChainSolution start = fit.solution.prediction.solution;
  for (std::size_t first = fitted_poses(fit), m = first; m < whole.measurements.size(); ++m) {
    Points x = start.X;
    if (base != nullptr) x += base->solved[m - first].x - base->X;
    start.poses.push_back({.name = whole.measurements[m]->pose.name, .x = std::move(x), .report = {}});
  }
  return start;
}

/// Points over the skin of the poses from @p first on.
calibration::PointMask points_from(std::size_t first, const Prediction& prediction) {
  calibration::PointMask mask = calibration::points_over_skin(prediction);
  for (std::size_t m = 0; m < first; ++m) mask[m].setConstant(false);
  return mask;
}

/// Names the first pose from @p first on that has no point in the mask; empty where all have.
std::string without_points(const MeasuredScene& whole, std::size_t first, const calibration::PointMask& mask) {
  for (std::size_t m = first; m < mask.size(); ++m)
    if (!mask[m].any())
      return "no point of the scan " + whole.measurements[m]->pose.name + " lies over the model's skin";
  return {};
}

/// What all points of the last measurements have, of those in the mask.
std::vector<Eigen::VectorXd> points_of(const std::vector<Eigen::VectorXd>& last, const calibration::PointMask& mask) {
  std::vector<Eigen::VectorXd> kept;
  for (std::size_t i = 0; i < last.size(); ++i) {
    const auto& of_scan = mask[mask.size() - last.size() + i];
    std::vector<int> points;
    for (Eigen::Index k = 0; k < of_scan.size(); ++k)
      if (of_scan[k]) points.push_back(static_cast<int>(k));
    kept.emplace_back(last[i](points));
  }
  return kept;
}

void keep(const WeightedFit& fit, const Prediction& prediction, const ErrorSources& sources, OtherPoses& others) {
  const std::size_t first = fitted_poses(fit);
  const auto& means = sources.unfitted_mean_mm;
  std::vector<Eigen::VectorXd> distances;
  for (std::size_t m = first; m < prediction.poses.size(); ++m) {
    distances.push_back(prediction.poses[m].distances.distance_mm);
    if (!means.empty()) distances.back() += means[m - first];
  }
  others.distance_mm = points_of(distances, others.mask);
  const auto& poses = prediction.solution.poses;
  others.solved.assign(poses.begin() + static_cast<std::ptrdiff_t>(first), poses.end());
  others.X = prediction.solution.X;
}

Eigen::VectorXd joined(const std::vector<Eigen::VectorXd>& parts) {
  Eigen::VectorXd all(0);
  for (const Eigen::VectorXd& part : parts) {
    all.conservativeResize(all.size() + part.size());
    all.tail(part.size()) = part;
  }
  return all;
}

/// Of each pose that has rows.
void add_noise(const calibration::Residuals& residuals, const Eigen::VectorXd& noise_mm, std::vector<double>& poses) {
  for (int pose = 0; residuals.size() > 0 && pose <= residuals.pose.maxCoeff(); ++pose) {
    const auto own = (residuals.pose.array() == pose).cast<double>();
    if (own.sum() > 0) poses.push_back(std::sqrt((own * noise_mm.array().square()).sum() / own.sum()));
  }
}

/// Of the points of others.mask, all of scans that are not fitted: errors as in the fitted scan, each scan with its own
/// place and breath, and what the fitted parameters are uncertain by.
void set_errors(calibration::Evaluator& evaluator, const FreeParameters& parameters, const WeightedFit& fit,
                const ErrorSources& sources, const Metric& metric, const Tolerances& tolerances,
                const Prediction& prediction, OtherPoses& others) {
  const MeasuredScene& whole = evaluator.scene();
  const simulation::Model model = parameters.model(fit.solution.u);
  std::vector<double> noise = metric.noise_mm;
  for (std::size_t m = noise.size(); m < whole.measurements.size(); ++m)
    noise.push_back(whole.measurements[m]->noise_mm.value_or(metric.noise_mm.front()));
  calibration::Fit seen;
  seen.prediction = prediction;
  seen.residuals = calibration::residuals_of(whole, prediction, others.mask, noise);
  std::vector<std::string> unseen;
  const auto candidates = find_candidates(evaluator, model, seen, unseen, errors_imitate);
  const auto& means = sources.unfitted_mean_mm;
  // Where a scan is not corrected for the mesh the whole of its error is left, about as large as in the fitted one, of
  // which the spread has the doubtful share already.
  const double in_full_mm =
      std::sqrt(std::max(0.0, 1 - sources.mean_doubt * sources.mean_doubt)) * rms(sources.mean_mm);
  const double spread_mm = means.empty() ? std::hypot(sources.spread_mm, in_full_mm) : sources.spread_mm;
  ErrorSources errors =
      error_sources(seen.residuals, candidates, nullptr, {0, spread_mm, sources.length_mm}, tolerances);
  if (!means.empty()) errors.modes.push_back({"mesh", sources.mean_doubt * joined(points_of(means, others.mask))});
  const simulation::Sensitivities sensitivities(evaluator.chain(), model, prediction.solution);
  const Eigen::MatrixXd slope =
      calibration::linearise(evaluator, sensitivities, parameters, fit.solution.u, prediction, seen.residuals).slope;
  const Eigen::MatrixXd covariance = covariance_of(information(fit, parameters, metric));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(covariance);
  const Eigen::MatrixXd shapes = slope * axes.eigenvectors() * axes.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  for (Eigen::Index i = 0; i < shapes.cols(); ++i) errors.modes.push_back({"parameters", shapes.col(i)});
  others.whitening = std::make_shared<Whitening>(Whitening::of(seen.residuals, errors));
  add_noise(seen.residuals, errors.noise_mm, others.noise_mm);
}

void weigh_unfitted(OtherPoses& others) {
  const Eigen::VectorXd white = others.whitening->apply(joined(others.distance_mm));
  others.objective = white.squaredNorm();
  others.misfit = others.objective / static_cast<double>(white.size());
}

void add_left_out(const FreeParameters& parameters, const WeightedFit& fit, const ErrorSources& sources,
                  OtherPoses& others) {
  for (Eigen::VectorXd& left_out : left_out_poses_mm(fit, parameters, sources))
    others.distance_mm.push_back(std::move(left_out));
}

bool says_the_scan_lies_elsewhere(const simulation::Model& model) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [](const auto& effect) { return simulation::traits_of(effect.name).moves_scan; });
}

}  // namespace

std::vector<double> OtherPoses::rms_mm() const {
  std::vector<double> all;
  for (const Eigen::VectorXd& d : distance_mm) all.push_back(rms(d));
  return all;
}

std::vector<double> OtherPoses::change_mm(const OtherPoses& other) const {
  std::vector<double> all;
  if (other.distance_mm.size() != distance_mm.size()) return all;
  for (std::size_t i = 0; i < distance_mm.size(); ++i) all.push_back(rms(distance_mm[i] - other.distance_mm[i]));
  return all;
}

OtherPoses other_poses_of_base(const MeasuredScene& whole, const FreeParameters& parameters, const WeightedFit& fit,
                               const ErrorSources& sources, const Metric& metric, const Tolerances& tolerances) {
  OtherPoses others;
  const simulation::Model model = parameters.model(fit.solution.u);
  const std::size_t first = fitted_poses(fit);
  if (!says_the_scan_lies_elsewhere(model) && whole.measurements.size() > first) try {
      calibration::Evaluator evaluator(whole, model, accurate_enough());
      const simulation::ChainSolution start = start_of(whole, fit, nullptr);
      const Prediction prediction = evaluator.predict(model, &start);
      others.mask = points_from(first, prediction);
      others.failure = without_points(whole, first, others.mask);
      if (others.failure.empty()) {
        others.unfitted = whole.measurements.size() - first;
        keep(fit, prediction, sources, others);
        set_errors(evaluator, parameters, fit, sources, metric, tolerances, prediction, others);
        weigh_unfitted(others);
      }
    } catch (const NumericalFailure& failure) {
      others = {};
      others.failure = failure.what();
    }
  const std::size_t unfitted = others.distance_mm.size();
  add_left_out(parameters, fit, sources, others);
  if (others.distance_mm.size() > unfitted) add_noise(fit.solution.residuals, sources.noise_mm, others.noise_mm);
  return others;
}

OtherPoses other_poses_of_refit(const MeasuredScene& whole, const FreeParameters& parameters, const WeightedFit& fit,
                                const ErrorSources& sources, const OtherPoses& base) {
  OtherPoses others;
  others.unfitted = base.unfitted;
  others.mask = base.mask;
  others.whitening = base.whitening;
  if (base.unfitted > 0) try {
      const simulation::Model model = parameters.model(fit.solution.u);
      const simulation::ChainSolution start = start_of(whole, fit, &base);
      keep(fit, calibration::Evaluator(whole, model, accurate_enough()).predict(model, &start), sources, others);
      weigh_unfitted(others);
    } catch (const NumericalFailure&) {
      return {};
    }
  add_left_out(parameters, fit, sources, others);
  return others;
}

}  // namespace supine::diagnosis
