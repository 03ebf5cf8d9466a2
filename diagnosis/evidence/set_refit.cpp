// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/set_refit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/error.h"
#include "common/rms.h"
#include "common/statistics.h"
#include "diagnosis/evidence/fit_errors.h"
#include "diagnosis/evidence/left_out.h"
#include "diagnosis/evidence/strength_profile.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using Eigen::Index;
using Eigen::VectorXd;

/// Nuisances that no effect of the set replaces.
std::vector<Nuisance> kept(const BaseFit& base, const std::vector<std::string>& effects) {
  std::vector<Nuisance> list = base.nuisances;
  std::erase_if(list, [&effects](const Nuisance& nuisance) {
    return nuisance.pose.empty() && std::find(effects.begin(), effects.end(), nuisance.effect) != effects.end();
  });
  return list;
}

/// Base numbers where the base fit has them, strengths where the screening has them.
VectorXd start_of(const FreeParameters& parameters, const BaseFit& base, const std::vector<Candidate>& candidates,
                  const Hypothesis& screened) {
  VectorXd u = parameters.start();
  const auto& names = parameters.names();
  for (Index i = 0; i < u.size(); ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    const auto& own = base.parameters->names();
    const auto found = std::find(own.begin(), own.end(), name);
    if (found != own.end()) u[i] = base.fit.u[found - own.begin()];
    const int place = screened.place_of(name);
    if (found != own.end() || place < 0) continue;
    for (const int effect : screened.effects)
      for (const CandidateParameter& p : candidates[static_cast<std::size_t>(effect)].parameters) {
        if (p.name != name) continue;
        const double reach = 3 * p.typical;  // a line drawn further than that is no longer the effect
        const double value = p.null + std::clamp(screened.weighed.number(place).first, -reach, reach);
        const double least = parameters.is_log(i) ? 0.1 * p.typical : -1e300;
        u[i] = parameters.coordinate(i, std::max(value, least));
      }
  }
  return parameters.clamped(u);
}

/// Densities of coordinates that are no normal ones.
using Curved = std::map<Index, CurvedDensity>;

std::vector<FittedParameter> parameters_of(const Refit& refit, const FreeParameters& parameters, const Curved& curved) {
  std::vector<FittedParameter> list;
  for (Index i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters.names()[static_cast<std::size_t>(i)];
    const std::string effect = name.substr(0, name.find('.'));
    if (std::find(refit.effects.begin(), refit.effects.end(), effect) == refit.effects.end()) continue;
    const auto [offset, sd] = refit.hypothesis.weighed.number(i);
    const double u = refit.fit.u[i] + offset, reach = normal_reach95() * sd;
    const auto value = [&](double at) {
      return parameters.value(i, std::clamp(at, parameters.lower()[i], parameters.upper()[i]));
    };
    const RangeEnd end = range_end(parameters, refit.fit.u, i);
    const auto at = curved.find(i);
    if (at == curved.end())
      list.push_back({name, parameters.unit(i), value(u), value(u - reach), value(u + reach), end});
    else
      list.push_back({name, parameters.unit(i), value(at->second.quantile(0.5)), value(at->second.quantile(0.025)),
                      value(at->second.quantile(0.975)), end});
  }
  return list;
}

/// Distances of the points with all numbers where the likeliest size of the discrepancy has them, to first order: the
/// chain was solved with nuisances where the base fit has them.
VectorXd distances_at_posterior(const BaseFit& base, const Hypothesis& h, const calibration::Residuals& residuals) {
  Index likeliest;
  h.weighed.size_probability.maxCoeff(&likeliest);
  const VectorXd change =
      h.evidence->directions().columns(Eigen::all, h.rows) * h.weighed.mean[static_cast<std::size_t>(likeliest)];
  VectorXd distance = residuals.distance_mm;
  for (Index r = 0; r < distance.size(); ++r) distance[r] += change[base.clusters.of_point[r]];
  return distance;
}

/// Fills the hypothesis of a fit: Laplace's evidence at the optimum.
void weigh_at(const BaseFit& base, const std::vector<Nuisance>& nuisances, const FreeParameters& parameters,
              Refit& result) {
  Hypothesis& h = result.hypothesis;
  h.refitted = true;
  h.evidence = std::make_shared<LinearEvidence>(*base.covariance, base.distances(result.fit.residuals),
                                                directions_at(result.fit, parameters, nuisances, base.clusters));
  h.rows.resize(static_cast<std::size_t>(h.evidence->directions().size()));
  std::iota(h.rows.begin(), h.rows.end(), 0);
  h.weighed = h.evidence->weigh(h.rows);
  h.ln_evidence = h.weighed.ln_evidence;
}

/// Densities of the strengths whose effects are far from linear, and the evidence corrected by each.
Curved curved_strengths(const RefitGround& ground, const std::vector<Candidate>& candidates,
                        const FreeParameters& parameters, Refit& result) {
  Curved curved;
  for (const int effect : result.hypothesis.effects) {
    const Candidate& candidate = candidates[static_cast<std::size_t>(effect)];
    if (!is_far_from_linear(candidate)) continue;
    const auto& names = parameters.names();
    const Index k = std::find(names.begin(), names.end(), candidate.parameters[0].name) - names.begin();
    auto density = strength_profile(ground, result, parameters, k);
    if (!density) continue;
    result.hypothesis.ln_evidence += density->ln_mass() - result.hypothesis.weighed.ln_evidence;
    curved.emplace(k, std::move(*density));
  }
  return curved;
}

/// Whether a place or width ended at the border of its range.
bool is_at_border(const std::vector<FittedParameter>& fitted) {
  return std::any_of(fitted.begin(), fitted.end(), [](const FittedParameter& p) {
    return simulation::find_parameter(p.name)->shape && p.end != RangeEnd::none;
  });
}

}  // namespace

RangeEnd range_end(const FreeParameters& parameters, const VectorXd& u, Index i) {
  constexpr double close = 0.01;  // of the range
  const double low = parameters.lower()[i], high = parameters.upper()[i], near = close * (high - low);
  if (high - u[i] < near) return RangeEnd::upper;
  const auto& row = *simulation::find_parameter(parameters.names()[static_cast<std::size_t>(i)]);
  const bool absent_there = row.one_sided && !row.shape;
  return u[i] - low < near && !absent_there ? RangeEnd::lower : RangeEnd::none;
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

Refit refit(const calibration::MeasuredScene& scene, const simulation::Model& given, const BaseFit& base,
            const std::vector<Candidate>& candidates, const Hypothesis& screened) {
  Refit result;
  simulation::Model model = given;
  for (const int effect : screened.effects) {
    result.effects.push_back(candidates[static_cast<std::size_t>(effect)].effect);
    model.effects.push_back(free_setting(result.effects.back()));
  }
  const std::vector<Nuisance> nuisances = kept(base, result.effects);
  std::vector<std::string> poses{scene.prone.name};
  for (const auto* measurement : scene.measurements) poses.push_back(measurement->pose.name);
  const FreeParameters parameters(with_nuisances(model, nuisances, poses));
  const FitErrors errors(base, nuisances, base.size_of(screened.weighed));
  try {
    calibration::Evaluator evaluator(scene, parameters.base(), accurate_enough());
    WeightedFit fit = weigh(evaluator, parameters, errors.metric(), start_of(parameters, base, candidates, screened),
                            &base.fit.prediction.solution);
    descend(evaluator, parameters, errors.metric(), DescentOptions{}, fit);
    result.fit = std::move(fit.solution);
  } catch (const NumericalFailure&) {
    return result;  // no equilibrium where the screening has it
  }
  result.solved = true;
  result.hypothesis = screened;
  weigh_at(base, nuisances, parameters, result);
  const Curved curved = curved_strengths({scene, base, errors.metric(), nuisances}, candidates, parameters, result);
  result.model = FreeParameters(model).model(result.fit.u);
  result.parameters = parameters_of(result, parameters, curved);
  result.at_border = is_at_border(result.parameters);
  result.rms_mm =
      rms(distances_at_posterior(base, result.hypothesis, result.fit.residuals).head(result.fit.residuals.skin_rows()));
  result.held_out_rms_mm = held_out_rms(base, result.hypothesis, result.fit.residuals);
  return result;
}

}  // namespace supine::diagnosis
