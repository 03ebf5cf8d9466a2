// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/mean_kernel.h"

#include <Eigen/Cholesky>
#include <functional>
#include <random>
#include <vector>

#include "calibration/work_limit.h"
#include "common/error.h"
#include "common/side_by_side.h"
#include "diagnosis/evidence/discrepancy.h"
#include "diagnosis/evidence/linear_evidence.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr unsigned seed = 1;

/// Offsets from the fit, each with that of the opposite sign: two draws and their mirror images.
std::vector<VectorXd> draw_offsets(const BaseFit& base) {
  const Weighed weighed = evidence_of(base, base).weigh_all();
  const std::size_t bin = weighed.likeliest();
  const MatrixXd root = weighed.covariance[bin].llt().matrixL();
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<VectorXd> offsets;
  for (std::size_t k = 0; k < kernel_draws; k += 2) {
    const VectorXd away = root * VectorXd::NullaryExpr(root.rows(), [&] { return normal(generator); });
    offsets.push_back(weighed.mean[bin] + away);
    offsets.push_back(weighed.mean[bin] - away);
  }
  return offsets;
}

/// @throws NumericalFailure  no equilibrium there
MovedFit moved_fit(const calibration::MeasuredScene& scene, const BaseFit& base, const VectorXd& offset) {
  const Index own = base.fit.u.size();
  JointTrial trial{base.parameters->clamped(base.fit.u + offset.head(own)), base.nuisances};
  for (std::size_t k = 0; k < trial.nuisances.size(); ++k)
    trial.nuisances[k].value += offset[own + static_cast<Index>(k)];
  MovedFit moved{with_nuisances(base.parameters->model(trial.u), trial.nuisances, poses_of(scene)), {}, {}};
  calibration::Evaluator evaluator(scene, moved.model, accurate_enough());
  const calibration::TrialLimit limit(evaluator.chain(), base.fit.prediction.solution.dearest_solve);
  const simulation::ChainSolution near = expected_at(trial, base.fit, base.nuisances);
  moved.prediction = evaluator.predict(moved.model, &near);
  const calibration::Residuals residuals =
      calibration::residuals_of(scene, moved.prediction, base.fit.mask, base.noise_mm);
  const simulation::Sensitivities sensitivities(evaluator.chain(), moved.model, moved.prediction.solution);
  moved.discrepancy = discrepancy_of(*scene.mesh, sensitivities, moved.prediction, residuals, base.clusters);
  return moved;
}

}  // namespace

void look_at_draws(const calibration::MeasuredScene& scene, const BaseFit& base,
                   const std::function<void(std::size_t draw, const MovedFit& moved)>& look) {
  const std::vector<VectorXd> offsets = draw_offsets(base);
  std::vector<std::function<void()>> works;
  for (std::size_t k = 0; k < offsets.size(); ++k)
    works.emplace_back([&, k] {
      try {
        look(k, moved_fit(scene, base, offsets[k]));
      } catch (const NumericalFailure&) {
        // such numbers carry no body
      }
    });
  side_by_side(works);
}

MatrixXd mean_kernel(const calibration::MeasuredScene& scene, const BaseFit& base) {
  std::vector<MatrixXd> kernels(kernel_draws);
  look_at_draws(scene, base, [&](std::size_t k, const MovedFit& moved) { kernels[k] = moved.discrepancy.kernel; });
  MatrixXd sum = base.kernel;
  int solved = 1;
  for (const MatrixXd& kernel : kernels)
    if (kernel.size() > 0) sum += kernel, ++solved;
  return sum / solved;
}

}  // namespace supine::diagnosis
