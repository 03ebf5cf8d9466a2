// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/set_fit.h"

#include <algorithm>
#include <cmath>

#include "calibration/work_limit.h"
#include "common/error.h"
#include "common/first_failure.h"
#include "diagnosis/evidence/strength_profile.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

constexpr int steps_of_screening = 3;

/// Nuisances that no effect of the set replaces.
std::vector<Nuisance> kept(const JointFit& from, const std::vector<std::string>& effects) {
  std::vector<Nuisance> list = from.nuisances;
  std::erase_if(list, [&effects](const Nuisance& nuisance) {
    return nuisance.pose.empty() && std::find(effects.begin(), effects.end(), nuisance.effect) != effects.end();
  });
  return list;
}

}  // namespace

Eigen::VectorXd start_at(const JointFit& set, const BaseFit& base) {
  Eigen::VectorXd u = set.parameters->start();
  const auto& names = set.parameters->names();
  const auto& own = base.parameters->names();
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const auto found = std::find(own.begin(), own.end(), names[static_cast<std::size_t>(i)]);
    if (found != own.end()) u[i] = base.fit.u[found - own.begin()];
  }
  return u;
}

simulation::EffectSetting free_setting(const std::string& name) {
  constexpr double least_share = 1e-3;  // of the usual size: where the logarithm of a strength ends
  const simulation::Effect& effect = *simulation::find_effect(name);
  simulation::EffectSetting setting = simulation::null_setting(effect);
  for (const simulation::Parameter& row : effect.parameters()) {
    const StrengthPrior prior = strength_prior(row);
    simulation::Setting& number = setting.parameters[row.name];
    number = {row.median, true, prior.spread, row.lower, row.upper};
    if (row.shape) number.prior_sd = simulation::prior_sd(row);
    if (!row.shape && prior.log_normal) {
      number.lower = std::max(row.lower, least_share * row.median);
      number.prior_sd = row.median * std::expm1(prior.spread);
    }
  }
  return setting;
}

JointFit unfitted(const simulation::Model& given, const BaseFit& base, const JointFit& from,
                  const std::vector<std::string>& effects) {
  simulation::Model model = given;
  for (const std::string& effect : effects) model.effects.push_back(free_setting(effect));
  JointFit fit;
  fit.parameters.emplace(model);
  fit.nuisances = kept(from, effects);
  fit.fit.mask = base.fit.mask;
  return fit;
}

void weigh_at(const BaseFit& base, const JointFit& fit, Hypothesis& h) {
  h.refitted = true;
  h.ground = &base;
  h.evidence = std::make_shared<LinearEvidence>(evidence_of(base, fit));
  h.rows = first_rows(h.evidence->directions().size());
  h.weighed = h.evidence->weigh(h.rows);
  h.ln_evidence = h.weighed.ln_evidence;
}

void fit_jointly(const calibration::MeasuredScene& scene, const BaseFit& base, const JointTrial& start,
                 const simulation::ChainSolution* near, int most_steps, JointFit& joint, Hypothesis& h) {
  calibration::Evaluator evaluator(scene, joint.parameters->base(), accurate_enough());
  JointFitter fitter(evaluator, joint, base);
  if (near != nullptr) {
    const calibration::TrialLimit limit(evaluator.chain(), std::max(base.dearest, near->dearest_solve));
    fitter.predict(start, near);
  } else {
    fitter.predict(start, nullptr);
  }
  fitter.linearise();
  fitter.descend(most_steps);
  weigh_at(base, joint, h);
}

void weigh_from_usual_size(const calibration::MeasuredScene& scene, const simulation::Model& given, const BaseFit& base,
                           const std::vector<Candidate>& candidates, const std::vector<std::string>& skipped,
                           std::vector<Hypothesis>& hypotheses) {
  const auto look = [&](Hypothesis& h) {
    if (h.effects.size() != 1 || h.refitted) return;
    const Candidate& candidate = candidates[static_cast<std::size_t>(h.effects.front())];
    if (!is_far_from_linear(candidate) || !candidate.secant_at) return;
    if (std::find(skipped.begin(), skipped.end(), candidate.effect) != skipped.end()) return;
    JointFit joint = unfitted(given, base, base, {candidate.effect});
    joint.size_mm = base.size_of(h.weighed);
    Hypothesis there = h;
    try {
      fit_jointly(scene, base, {start_at(joint, base), joint.nuisances}, candidate.secant_at.get(), steps_of_screening,
                  joint, there);
    } catch (const NumericalFailure&) {
      return;  // no equilibrium there: lines from nothing have to do
    }
    if (there.ln_evidence <= h.ln_evidence) return;
    h = std::move(there);
    h.refitted = false;
    h.from_usual = true;
    h.screened = h.ln_evidence;
  };
  FirstFailure failure;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < hypotheses.size(); ++i) failure.guard([&] { look(hypotheses[i]); });
  failure.rethrow();
  normalise(hypotheses);
}

}  // namespace supine::diagnosis
