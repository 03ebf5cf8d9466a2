// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/force_map.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "diagnosis/evidence/field_modes.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int most_centres = 60;

/// Distance of the last centre, which is the nearest to another, from the rest; 1 where there is no other.
double spacing_of(const Points& centres) {
  const Index rest = centres.rows() - 1;
  if (rest < 1) return 1;
  return (centres.topRows(rest).rowwise() - centres.row(rest)).rowwise().norm().minCoeff();
}

/// A third of the deformed area of the skin's triangles about each mesh point.
VectorXd node_areas(const calibration::ModelSkin& skin, const Points& x) {
  VectorXd area = VectorXd::Zero(x.rows());
  for (Index t = 0; t < skin.triangles().rows(); ++t) {
    const auto corner = [&](int k) -> Eigen::Vector3d { return x.row(skin.triangles()(t, k)).transpose(); };
    const double share = (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm() / 6;
    for (int k = 0; k < 3; ++k) area[skin.triangles()(t, k)] += share;
  }
  return area;
}

/// ∂d/∂a of every bump and axis, #R by 3 #centres, mm per kPa.
MatrixXd slopes(const calibration::MeasuredScene& scene, const simulation::Model& model, const calibration::Fit& fit,
                const Points& centres, double width, std::size_t pose) {
  calibration::Evaluator evaluator(scene, model);
  const simulation::Sensitivities sensitivities(evaluator.chain(), model, fit.prediction.solution);
  const Points& x = fit.prediction.solution.poses[pose].x;
  const calibration::ModelSkin skin(*scene.mesh, x);
  const VectorXd area = node_areas(skin, x);
  const MatrixXd weight = gaussian_kernel(x, centres, width);
  std::vector<VectorXd> forces;
  for (Index c = 0; c < centres.rows(); ++c)
    for (int axis = 0; axis < 3; ++axis) {
      VectorXd& force = forces.emplace_back(VectorXd::Zero(x.size()));
      for (const int node : skin.nodes()) force[3 * node + axis] = area[node] * weight(node, c);
    }
  const std::vector<Points> moved = sensitivities.moved_by(pose, forces);
  std::vector<Points> moves(fit.prediction.poses.size());
  MatrixXd columns(fit.residuals.size(), 3 * centres.rows());
  for (Index f = 0; f < columns.cols(); ++f) {
    moves[pose] = moved[static_cast<std::size_t>(f)];
    columns.col(f) = calibration::distance_change(fit.prediction, fit.residuals, moves);
  }
  return columns;
}

/// Forces with variance τ² behind whitened distances: G = U S Vᵀ, d ~ N(0, I + τ² G Gᵀ).
class Evidence {
 public:
  explicit Evidence(const MatrixXd& g) : svd_(g, Eigen::ComputeThinU | Eigen::ComputeThinV) {}

  /// ln evidence over τ = 0 at the best τ of a grid, and that τ.
  std::pair<double, double> best(const VectorXd& d) const {
    const VectorXd along = svd_.matrixU().transpose() * d;
    double gain = 0, amplitude = 0;
    for (double log_tau = -7; log_tau <= 1; log_tau += 0.25) {
      const double tau = std::exp(log_tau);
      const Eigen::ArrayXd extra = (tau * svd_.singularValues().array()).square();
      const double now = 0.5 * (along.array().square() * extra / (1 + extra) - (1 + extra).log()).sum();
      if (now > gain) gain = now, amplitude = tau;
    }
    return {gain, amplitude};
  }

  /// Posterior mean of the coefficients that explain d. Distances go down where the skin follows the scan, so a = −.
  VectorXd coefficients(const VectorXd& d, double tau) const {
    const Eigen::ArrayXd s = svd_.singularValues().array();
    const VectorXd along = svd_.matrixU().transpose() * d;
    return -svd_.matrixV() * (tau * tau * s / (1 + tau * tau * s.square()) * along.array()).matrix();
  }

 private:
  Eigen::BDCSVD<MatrixXd> svd_;
};

Points field(const MatrixXd& weight, const VectorXd& coefficients) {
  const Points by_centre = Eigen::Map<const Points>(coefficients.data(), coefficients.size() / 3, 3);
  return weight * by_centre;
}

double quantile95(std::vector<double> values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

ForceMap force_map(const calibration::MeasuredScene& scene, const simulation::Model& model, const calibration::Fit& f,
                   const Metric& metric, unsigned seed, int draws) {
  const calibration::ModelSkin skin(*scene.mesh, f.prediction.solution.poses[0].x);
  const Points nodes = skin.node_points();
  const Points centres = nodes(spread_out(nodes, most_centres), Eigen::all);
  const double width = spacing_of(centres);
  const MatrixXd absorbed = metric.whitening->apply(f.linearisation.slope);
  const auto solver = absorbed.completeOrthogonalDecomposition();
  const auto freed = [&](const MatrixXd& a) -> MatrixXd { return a - absorbed * solver.solve(a); };
  const Evidence evidence(freed(metric.whitening->apply(slopes(scene, model, f, centres, width, 0))));
  const VectorXd d = freed(metric.whitening->apply(f.residuals.distance_mm + metric.mean_mm));
  const MatrixXd weight = gaussian_kernel(f.residuals.place.topRows(f.residuals.skin_rows()), centres, width);
  ForceMap map;
  std::tie(map.evidence_gain, map.amplitude_kpa) = evidence.best(d);
  map.force_kpa = field(weight, evidence.coefficients(d, map.amplitude_kpa));
  std::vector<double> largest, gains;
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  VectorXd z(d.size());
  for (int draw = 0; draw < draws; ++draw) {
    for (double& number : z) number = normal(generator);
    const VectorXd noise = freed(z);
    const auto [gain, tau] = evidence.best(noise);
    const Points forces = field(weight, evidence.coefficients(noise, std::max(tau, map.amplitude_kpa)));
    if (draw == 0) map.null_kpa = forces;
    largest.push_back(forces.rowwise().norm().maxCoeff());
    gains.push_back(gain);
  }
  map.threshold_kpa = quantile95(largest);
  map.null_gain = quantile95(gains);
  return map;
}

}  // namespace supine::diagnosis
