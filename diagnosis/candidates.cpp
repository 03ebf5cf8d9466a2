// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/candidates.h"

#include <algorithm>
#include <cmath>

#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using simulation::Effect;
using simulation::Parameter;

constexpr double unfelt_mm = 1e-6;  // rms movement of the fitted points at the typical size

bool has(const simulation::Model& model, const Effect& effect) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [&effect](const simulation::EffectSetting& s) { return s.name == effect.name(); });
}

double typical_size(const Parameter& row) {
  const double size = std::abs(row.median - row.null);
  return size > 0 ? size : row.spread;
}

}  // namespace

std::vector<Candidate> lacking_effects(const simulation::Model& model, const meshing::TetMesh& mesh,
                                       const meshing::Anatomy& anatomy) {
  std::vector<Candidate> all;
  for (const Effect* effect : simulation::catalogue()) {
    if (simulation::is_stand_in(*effect) || has(model, *effect) || !effect->belongs_to(mesh, anatomy, model)) continue;
    Candidate candidate{effect->name(), {}, {}, {}};
    for (const Parameter& row : effect->parameters())
      if (!row.shape)
        candidate.parameters.push_back({simulation::parameter_name(*effect, row), row.unit, row.null, row.lower,
                                        row.upper, typical_size(row), row.one_sided});
    all.push_back(std::move(candidate));
  }
  return all;
}

void move_along(const Candidate& candidate, std::size_t k, double step, simulation::ChainSolution& solution) {
  constexpr double furthest_mm = 5;
  if (candidate.motion.empty()) return;
  const simulation::ChainDerivative& motion = *candidate.motion[k];
  double most = motion.X.rowwise().norm().maxCoeff();
  for (const Points& x : motion.poses) most = std::max(most, x.rowwise().norm().maxCoeff());
  const double reach = furthest_mm / std::max(most, 1e-300);
  calibration::move_along(motion, std::clamp(step, -reach, reach), solution);
}

std::vector<Candidate> find_candidates(calibration::Evaluator& evaluator, const simulation::Model& model,
                                       const calibration::Fit& fit, std::vector<std::string>& unseen) {
  const simulation::Sensitivities sensitivities(evaluator.chain(), model, fit.prediction.solution);
  std::vector<Candidate> candidates;
  const std::vector<Candidate> lacking_ones =
      lacking_effects(model, *evaluator.scene().mesh, *evaluator.scene().anatomy);
  std::vector<std::string> names;
  for (const Candidate& lacking : lacking_ones)
    for (const CandidateParameter& number : lacking.parameters) names.push_back(number.name);
  std::vector<simulation::ChainDerivative> motions = sensitivities.of(names);
  auto next = motions.begin();
  for (const Candidate& lacking : lacking_ones) {
    Candidate candidate{lacking.effect, {}, Eigen::MatrixXd(fit.residuals.size(), 0), {}};
    for (const CandidateParameter& number : lacking.parameters) {
      auto motion = std::make_shared<const simulation::ChainDerivative>(std::move(*next++));
      const Eigen::VectorXd slope =
          calibration::slope_at(evaluator, model, fit.prediction, fit.residuals, number.name, *motion);
      const double rms = slope.norm() / std::sqrt(static_cast<double>(slope.size()));
      if (!(rms * number.typical > unfelt_mm)) continue;
      candidate.parameters.push_back(number);
      candidate.motion.push_back(std::move(motion));
      candidate.slope.conservativeResize(Eigen::NoChange, candidate.slope.cols() + 1);
      candidate.slope.col(candidate.slope.cols() - 1) = slope;
    }
    if (candidate.parameters.empty())
      unseen.push_back(lacking.effect);
    else
      candidates.push_back(std::move(candidate));
  }
  return candidates;
}

}  // namespace supine::diagnosis
