// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "common/statistics.h"
#include "registration/observations.h"

namespace supine::registration {
namespace {

using StateMatrix = Eigen::Matrix<double, unknowns, unknowns>;
constexpr int fit_points = 320, most_sorted_points = 20000, settle_iterations = 12, average_iterations = 4;
constexpr double softness_sd = 0.3, rigid_length_mm = 40;
constexpr double misfits_mm[] = {0.8, 1.6, 3.2, 6.4, 12.8}, lengths_mm[] = {15, 30, 60, 120};

double matern(double distance, double length) {
  const double scaled = std::sqrt(3.0) * distance / length;
  return (1 + scaled) * std::exp(-scaled);
}

/// One guess at the errors' spread, and what it says.
struct Answer {
  State step;
  StateMatrix covariance;
  double log_evidence;
  double misfit_mm, length_mm, effective_points;
};

/// What is believed before the scan is looked at: how far the present state is from it, and how firm it is.
struct Prior {
  State present;
  State precision;
};

/// Covariance of the body's own error at two observations, as if seen along the same direction.
struct BodyError {
  double misfit_mm, length_mm, rigid_mm;

  double operator()(const Observations& seen, Eigen::Index i, Eigen::Index j) const {
    if (seen.rigid[i] != seen.rigid[j]) return 0;
    const double spread = seen.rigid[i] ? rigid_mm : misfit_mm, length = seen.rigid[i] ? rigid_length_mm : length_mm;
    return spread * spread * matern((seen.place.row(i) - seen.place.row(j)).norm(), length);
  }
};

/// Of all errors; @p effective becomes how many independent points would fix a mean as well as these do.
Eigen::MatrixXd error_covariance(const Observations& seen, const BodyError& body, double& effective) {
  const Eigen::Index count = seen.residual.size();
  Eigen::MatrixXd covariance(count, count);
  double sum = seen.noise_mm.squaredNorm(), trace = sum;
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double shared = body(seen, i, j);
      covariance(i, j) = shared * seen.direction.row(i).dot(seen.direction.row(j));
      sum += i == j ? shared : 2 * shared;
      if (i == j) trace += shared;
    }
  covariance.diagonal() += seen.noise_mm.cwiseAbs2();
  effective = trace * static_cast<double>(count) / sum;
  return covariance;
}

Answer answer(const Observations& seen, const Prior& prior, const BodyError& body) {
  Answer found;
  const Eigen::LLT<Eigen::MatrixXd> factor(error_covariance(seen, body, found.effective_points));  // lower half is read
  const Eigen::MatrixXd white = factor.matrixL().solve(seen.jacobian);
  const Eigen::VectorXd residual = factor.matrixL().solve(seen.residual);
  StateMatrix normal = white.transpose() * white;
  normal.diagonal() += prior.precision;
  const State gradient = white.transpose() * residual + prior.precision.cwiseProduct(prior.present);
  const Eigen::LLT<StateMatrix> solver(normal);
  found.step = -solver.solve(gradient);
  found.covariance = solver.solve(StateMatrix::Identity());
  const double log_determinant =
      2 * factor.matrixLLT().diagonal().array().log().sum() + 2 * solver.matrixLLT().diagonal().array().log().sum();
  const double misfit =
      residual.squaredNorm() + prior.present.cwiseAbs2().dot(prior.precision) + gradient.dot(found.step);
  found.log_evidence = -(log_determinant + misfit) / 2;
  found.misfit_mm = body.misfit_mm;
  found.length_mm = body.length_mm;
  return found;
}

/// The mean of answers weighted by their evidence; log-means of misfit and length.
Answer averaged(const std::vector<Answer>& answers) {
  double best = answers.front().log_evidence, sum = 0;
  for (const Answer& a : answers) best = std::max(best, a.log_evidence);
  std::vector<double> weight;
  for (const Answer& a : answers) sum += weight.emplace_back(std::exp(a.log_evidence - best));
  Answer mean{State::Zero(), StateMatrix::Zero(), best, 0, 0, 0};
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const double share = weight[k] / sum;
    mean.step += share * answers[k].step;
    mean.misfit_mm += share * std::log(answers[k].misfit_mm);
    mean.length_mm += share * std::log(answers[k].length_mm);
    mean.effective_points += share * answers[k].effective_points;
  }
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const State off = answers[k].step - mean.step;
    mean.covariance += weight[k] / sum * (answers[k].covariance + off * off.transpose());
  }
  mean.misfit_mm = std::exp(mean.misfit_mm);
  mean.length_mm = std::exp(mean.length_mm);
  return mean;
}

std::vector<Answer> all_answers(const Observations& seen, const Prior& prior, double rigid_mm) {
  constexpr int across = std::size(lengths_mm), total = std::size(misfits_mm) * across;
  std::vector<Answer> answers(total);
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < total; ++k)
    answers[k] = answer(seen, prior, {misfits_mm[k / across], lengths_mm[k % across], rigid_mm});
  return answers;
}

/// The point about which shift and turn are least entangled: it minimises the trace of the shift's covariance. About
/// it a scan that can slide over a round body only turns, and the region stays an ellipsoid for large turns.
void move_to_best_pivot(Fit& found) {
  constexpr double furthest_mm = 300;
  const Eigen::Matrix3d turn = found.covariance.bottomRightCorner<3, 3>(),
                        both = found.covariance.bottomLeftCorner<3, 3>();
  const Eigen::Vector3d twist(both(1, 2) - both(2, 1), both(2, 0) - both(0, 2), both(0, 1) - both(1, 0));
  Eigen::Vector3d arm = (turn.trace() * Eigen::Matrix3d::Identity() - turn).ldlt().solve(twist);
  if (arm.norm() > furthest_mm) arm *= furthest_mm / arm.norm();
  found.covariance = covariance_about(found, found.pivot + arm);
  found.pivot += arm;
}

/// Matches further than four robust standard deviations count for nothing.
Gate next_gate(const Observations& seen, double noise_mm) {
  return {std::max(4 * noise_mm, 4 * 1.4826 * median(seen.residual.cwiseAbs()))};
}

/// The skin where it lies with the present softness.
class SoftSkin {
 public:
  explicit SoftSkin(const Problem& problem) : problem_(problem) {
    if (!problem.target.skin || problem.target.skin_displacement.rows() == 0) return;
    skin_.emplace(problem.target.skin->points(), problem.target.skin->triangles());
    problem_.target.skin = &*skin_;
    rest_ = problem.target.skin->points();
  }
  const Problem& at(double softness) {
    if (skin_) skin_->move(rest_ + softness * problem_.target.skin_displacement);
    return problem_;
  }

 private:
  Problem problem_;
  Points rest_;
  std::optional<calibration::SurfaceDistance> skin_;
};

/// @p count of @p rows, drawn.
std::vector<int> some_of(const std::vector<int>& rows, std::size_t count) {
  std::vector<int> kept;
  for (const int at : drawn_rows(static_cast<Eigen::Index>(rows.size()), static_cast<int>(count)))
    kept.push_back(rows[static_cast<std::size_t>(at)]);
  return kept;
}

/// Up to half of the points from what is rigid, however little of the scan it is: it says more than what deforms.
std::vector<int> rows_to_fit(const Problem& problem, const RigidTransform& start) {
  const std::vector<int> all = drawn_rows(problem.points.rows(), most_sorted_points);
  if (!problem.target.skin || !problem.target.rigid) return some_of(all, fit_points);
  const Matches matches = match(problem, all, start);
  std::vector<int> rigid, soft;
  for (std::size_t q = 0; q < all.size(); ++q) (matches.rigid[q] ? rigid : soft).push_back(all[q]);
  std::vector<int> rows = some_of(rigid, fit_points / 2);
  const std::vector<int> others = some_of(soft, fit_points - rows.size());
  rows.insert(rows.end(), others.begin(), others.end());
  std::sort(rows.begin(), rows.end());
  return rows;
}

/// Points that say the same: each counts for less.
Problem with_repeats(Problem problem) {
  const auto drawn = static_cast<double>(std::min<Eigen::Index>(fit_points, problem.points.rows()));
  if (problem.independent_points) problem.noise_mm *= std::sqrt(std::max(1.0, drawn / *problem.independent_points));
  return problem;
}

}  // namespace

Fit fit(const Problem& given, const RigidTransform& start, const Belief& belief) {
  const Problem problem = with_repeats(given);
  const std::vector<int> rows = rows_to_fit(problem, start);
  const Eigen::RowVector3d centre = problem.points.colwise().mean();
  Fit found;
  found.transform = start;
  Prior prior;
  prior.precision << Eigen::Vector3d::Constant(1 / (belief.shift_mm * belief.shift_mm)),
      Eigen::Vector3d::Constant(1 / (belief.turn_rad * belief.turn_rad)), 1 / (softness_sd * softness_sd);
  Gate gate{lost_mm};
  const RigidTransform back = start.inverse();
  SoftSkin skin(problem);
  for (int i = 0; i < settle_iterations + average_iterations; ++i) {
    found.pivot = found.transform.at(centre.transpose());
    const Observations seen =
        observe(skin.at(found.softness), rows, found.transform, found.pivot, found.softness, gate);
    const RigidTransform since = back.then(found.transform);
    prior.present << found.pivot - start.at(centre.transpose()), motion_about(found.pivot, since).tail<3>(),
        found.softness;
    const Answer next = i < settle_iterations ? answer(seen, prior, {2.4, 30, problem.rigid_sigma_mm})
                                              : averaged(all_answers(seen, prior, problem.rigid_sigma_mm));
    found.transform = found.transform.then(turned_about(found.pivot, next.step.head<6>()));
    found.pivot += next.step.head<3>();
    found.softness += next.step[6];
    found.softness_sd = std::sqrt(next.covariance(6, 6));
    found.covariance = (1 + 6 / next.effective_points) * next.covariance.topLeftCorner<6, 6>();
    found.misfit_mm = next.misfit_mm;
    found.misfit_length_mm = next.length_mm;
    found.effective_points = next.effective_points;
    found.rows = static_cast<int>(seen.residual.size());
    gate = next_gate(seen, problem.noise_mm);
  }
  move_to_best_pivot(found);
  return found;
}

Eigen::Matrix<double, 6, 6> covariance_about(const Fit& found, const Eigen::Vector3d& point) {
  const Eigen::Vector3d arm = point - found.pivot;
  Eigen::Matrix3d cross;
  cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
  Eigen::Matrix<double, 6, 6> change = Eigen::Matrix<double, 6, 6>::Identity();
  change.topRightCorner<3, 3>() = -cross;
  return change * found.covariance * change.transpose();
}

double mahalanobis_squared(const Fit& found, const RigidTransform& truth) {
  const Motion off = motion_about(found.pivot, found.transform.inverse().then(truth));
  return off.dot(found.covariance.ldlt().solve(off));
}

}  // namespace supine::registration
