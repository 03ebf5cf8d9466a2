// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/force_map.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"
#include "simulation/solve/linear_solver.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int most_centres = 60;

/// Points that lie as far from each other as they can, from the first one on; @p spacing: the last gap.
std::vector<int> spread_out(const Points& points, int most, double& spacing) {
  std::vector<int> chosen{0};
  VectorXd gap = (points.rowwise() - points.row(0)).rowwise().norm();
  while (static_cast<int>(chosen.size()) < most) {
    Index next;
    spacing = gap.maxCoeff(&next);
    if (!(spacing > 0)) break;
    chosen.push_back(static_cast<int>(next));
    gap = gap.cwiseMin((points.rowwise() - points.row(next)).rowwise().norm());
  }
  return chosen;
}

/// Gaussian bumps, #points by #centres.
MatrixXd bumps(const Points& points, const Points& centres, double width) {
  MatrixXd weight(points.rows(), centres.rows());
  for (Index c = 0; c < centres.rows(); ++c)
    weight.col(c) = (-(points.rowwise() - centres.row(c)).rowwise().squaredNorm().array() / (2 * width * width)).exp();
  return weight;
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

/// Moves of the nodes of one pose under unit bumps: solves with its tangent.
class PoseTangent {
 public:
  PoseTangent(const calibration::MeasuredScene& scene, const simulation::Model& model, const calibration::Fit& fit,
              std::size_t pose, simulation::Chain& chain)
      : mechanics_(*scene.mesh, *scene.anatomy, model), sums_(mechanics_.pattern()) {
    const auto& solution = fit.prediction.solution;
    mechanics_.set_fields(simulation::values_of(chain.fields(model, scene.measurements[pose]->pose)));
    mechanics_.evaluate({solution.poses[pose].x, solution.X, 1.0}, {.residual = true, .tangent = true}, sums_);
    if (mechanics_.has_energy()) {
      cholesky_ = std::make_unique<simulation::CholeskySolver>(sums_.tangent);
      if (cholesky_->factorise(sums_.tangent)) return;
      cholesky_.reset();
    }
    lu_ = std::make_unique<simulation::LuSolver>(sums_.tangent);
    if (!lu_->factorise(sums_.tangent)) throw NumericalFailure("the tangent is singular: no map of missing forces");
  }

  /// @param force  3 per node, mN
  Points move(const VectorXd& force) const {
    const VectorXd dx = cholesky_ ? cholesky_->solve(force) : lu_->solve(force);
    return Eigen::Map<const Points>(dx.data(), dx.size() / 3, 3);
  }

 private:
  simulation::Mechanics mechanics_;
  simulation::Sums sums_;
  std::unique_ptr<simulation::CholeskySolver> cholesky_;
  std::unique_ptr<simulation::LuSolver> lu_;
};

/// ∂d/∂a of every bump and axis, #R by 3 #centres; a parameter that moves neither scan nor image lends its name.
MatrixXd slopes(const calibration::MeasuredScene& scene, const simulation::Model& model, const calibration::Fit& fit,
                const Points& centres, double width, std::size_t pose) {
  const std::string lender = "breast.young_modulus_kpa";
  calibration::Evaluator evaluator(scene, model);
  const PoseTangent tangent(scene, model, fit, pose, evaluator.chain());
  const auto& solution = fit.prediction.solution;
  const Points& x = solution.poses[pose].x;
  const calibration::ModelSkin skin(*scene.mesh, x);
  const VectorXd area = node_areas(skin, x);
  const MatrixXd weight = bumps(x, centres, width);
  simulation::ChainDerivative derivative;
  derivative.prone = derivative.X = Points::Zero(x.rows(), 3);
  derivative.poses.assign(solution.poses.size(), Points::Zero(x.rows(), 3));
  MatrixXd columns(fit.residuals.size(), 3 * centres.rows());
  for (Index c = 0; c < centres.rows(); ++c)
    for (int axis = 0; axis < 3; ++axis) {
      VectorXd force = VectorXd::Zero(x.size());
      for (const int node : skin.nodes()) force[3 * node + axis] = area[node] * weight(node, c);
      derivative.poses[pose] = tangent.move(force);
      columns.col(3 * c + axis) =
          calibration::slope_at(evaluator, model, fit.prediction, fit.residuals, lender, derivative);
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
  double width = 1;
  const Points centres = nodes(spread_out(nodes, most_centres, width), Eigen::all);
  const MatrixXd absorbed = metric.whitening->apply(f.linearisation.slope);
  const auto solver = absorbed.completeOrthogonalDecomposition();
  const auto freed = [&](const MatrixXd& a) -> MatrixXd { return a - absorbed * solver.solve(a); };
  const Evidence evidence(freed(metric.whitening->apply(slopes(scene, model, f, centres, width, 0))));
  const VectorXd d = freed(metric.whitening->apply(f.residuals.distance_mm + metric.mean_mm));
  const MatrixXd weight = bumps(f.residuals.place, centres, width);
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
