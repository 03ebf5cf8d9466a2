// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/set_refit.h"

#include <algorithm>
#include <cmath>
#include <map>

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

constexpr double far = 1;        // of a nuisance, in sigma: its shape holds no more
constexpr double misplaced = 2;  // the same: a fit that has it there is no place to begin
constexpr int most_joint_steps = 8;

double offset_of(const Hypothesis& h, const std::string& name) {
  const int place = h.place_of(name);
  return place < 0 ? 0 : h.weighed.number(place).first;
}

/// A strength where the screening has it.
double screened_value(const CandidateParameter& p, const Hypothesis& screened, bool is_log) {
  const double reach = 3 * p.typical;  // a line drawn further than that is no longer the effect
  const double value = p.null + std::clamp(offset_of(screened, p.name), -reach, reach);
  return is_log ? std::max(value, 0.1 * p.typical) : value;
}

/// Numbers that the earlier fit has where it has them, strengths of what is new where the screening has them.
VectorXd start_of(const FreeParameters& parameters, const JointFit& from, const std::vector<Candidate>& candidates,
                  const Hypothesis& screened) {
  VectorXd u = parameters.start();
  const auto& names = parameters.names();
  const auto& own = from.parameters->names();
  for (Index i = 0; i < u.size(); ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    const auto found = std::find(own.begin(), own.end(), name);
    if (found != own.end()) {
      u[i] = from.fit.u[found - own.begin()];
      continue;
    }
    for (const int effect : screened.effects)
      for (const CandidateParameter& p : candidates[static_cast<std::size_t>(effect)].parameters)
        if (p.name == name) u[i] = parameters.coordinate(i, screened_value(p, screened, parameters.is_log(i)));
  }
  return parameters.clamped(u);
}

/// The shapes at such a start: those of the earlier fit, moved by what is new.
simulation::ChainSolution shapes_at(const VectorXd& start, const FreeParameters& parameters, const JointFit& from,
                                    const std::vector<Candidate>& candidates, const Hypothesis& screened) {
  simulation::ChainSolution near = from.fit.prediction.solution;
  const auto& names = parameters.names();
  const auto& own = from.parameters->names();
  for (const int effect : screened.effects) {
    const Candidate& candidate = candidates[static_cast<std::size_t>(effect)];
    for (std::size_t k = 0; k < candidate.parameters.size(); ++k) {
      const CandidateParameter& p = candidate.parameters[k];
      if (std::find(own.begin(), own.end(), p.name) != own.end()) continue;
      const Index i = std::find(names.begin(), names.end(), p.name) - names.begin();
      move_along(candidate, k, parameters.value(i, start[i]) - p.null, near);
    }
  }
  return near;
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
    const double u = refit.joint.fit.u[i] + offset, reach = normal_reach95() * sd;
    const auto value = [&](double at) {
      return parameters.value(i, std::clamp(at, parameters.lower()[i], parameters.upper()[i]));
    };
    VectorXd middle = refit.joint.fit.u;
    middle[i] = std::clamp(u, parameters.lower()[i], parameters.upper()[i]);
    RangeEnd end = range_end(parameters, refit.joint.fit.u, i);
    if (end == RangeEnd::none) end = range_end(parameters, middle, i);
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
  const VectorXd change = h.evidence->directions().columns(Eigen::all, h.rows) * h.weighed.mean[h.weighed.likeliest()];
  VectorXd distance = residuals.distance_mm;
  for (Index r = 0; r < distance.size(); ++r) distance[r] += change[base.clusters.of_point[r]];
  return distance;
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

namespace {

/// Numbers with nuisances as errors, then, where that leads far, with them.
void fit_set(const calibration::MeasuredScene& scene, const BaseFit& base, const VectorXd& start,
             const simulation::ChainSolution* near, JointFit& joint, Hypothesis& h) {
  const FreeParameters there(with_nuisances(joint.parameters->base(), joint.nuisances, poses_of(scene)));
  calibration::Evaluator evaluator(scene, there.base(), accurate_enough());
  const FitErrors errors(base, joint.nuisances, joint.size_mm);
  WeightedFit fit = weigh(evaluator, there, errors.metric(), start, near);
  descend(evaluator, there, errors.metric(), DescentOptions{}, fit);
  joint.fit = std::move(fit.solution);
  joint.model = there.model(joint.fit.u);
  weigh_at(base, joint, h);
  const VectorXd& mean = h.weighed.mean[h.weighed.likeliest()];
  const Index nuisances = mean.size() - joint.fit.u.size();
  if (nuisances == 0 || mean.tail(nuisances).cwiseAbs().maxCoeff() < far) return;
  JointFitter fitter(evaluator, joint, base);
  fitter.linearise();
  fitter.descend(most_joint_steps);
  weigh_at(base, joint, h);
}

/// How far off a fit would lie with nothing moved, rms of its points of skin, to first order.
double unmoved_rms_mm(const JointFit& fit) {
  VectorXd distance = fit.fit.residuals.distance_mm;
  for (const Nuisance& nuisance : fit.nuisances) distance -= nuisance.value * nuisance.shape_mm;
  return rms(distance.head(fit.fit.residuals.skin_rows()));
}

bool is_misplaced(const JointFit& fit) {
  return std::any_of(fit.nuisances.begin(), fit.nuisances.end(),
                     [](const Nuisance& nuisance) { return std::abs(nuisance.value) > misplaced; });
}

/// Whether a fit may have moved what should stay, and begun with nothing moved may end elsewhere.
bool may_be_misled(const JointFit& fit) { return is_misplaced(fit) && unmoved_rms_mm(fit) < lost_mm; }

/// The same with effects at their usual size and nothing moved, but of a scan that lies far off. @return  whether that
/// has an equilibrium
bool fit_afresh(const calibration::MeasuredScene& scene, const BaseFit& base, const JointFit& from, Hypothesis& h,
                JointFit& joint) {
  if (unmoved_rms_mm(from) < lost_mm)
    for (Nuisance& nuisance : joint.nuisances) nuisance.value = 0;
  try {
    fit_jointly(scene, base, {joint.parameters->start(), joint.nuisances}, nullptr, 2 * most_joint_steps, joint, h);
    return true;
  } catch (const NumericalFailure&) {
    return false;
  }
}

/// The likelier fit of the one that goes on from an earlier fit and, where lines did not lead there, one that begins
/// afresh.
bool find_fit(const calibration::MeasuredScene& scene, const BaseFit& base, const JointFit& from,
              const std::vector<Candidate>& candidates, const Hypothesis& screened, Refit& result) {
  const JointFit unfitted = result.joint;
  Hypothesis& h = result.hypothesis = screened;
  if (screened.from_usual && fit_afresh(scene, base, from, h, result.joint)) return result.solved = true;
  if (screened.from_usual) result.joint = unfitted, h = screened;
  try {
    const VectorXd start = start_of(*unfitted.parameters, from, candidates, screened);
    const simulation::ChainSolution near = shapes_at(start, *unfitted.parameters, from, candidates, screened);
    fit_set(scene, base, start, &near, result.joint, h);
    result.solved = true;
  } catch (const NumericalFailure&) {
    // No equilibrium where the screening has it.
  }
  const bool bent = result.solved && std::abs(screened.screened - h.ln_evidence) > lines_bend_at;
  if (screened.drawn_at < 0 && !bent && !may_be_misled(from)) return result.solved;
  JointFit other = unfitted;
  Hypothesis afresh = screened;
  if (fit_afresh(scene, base, from, afresh, other) && (!result.solved || afresh.ln_evidence > h.ln_evidence)) {
    result.joint = std::move(other);
    h = std::move(afresh);
    result.solved = true;
  }
  return result.solved;
}

std::vector<std::string> names_of(const Hypothesis& h, const std::vector<Candidate>& candidates) {
  std::vector<std::string> names;
  for (const int effect : h.effects) names.push_back(candidates[static_cast<std::size_t>(effect)].effect);
  return names;
}

/// Fills what a fit says of its set, by Laplace.
void tell_of(const BaseFit& base, Refit& result) {
  const JointFit& joint = result.joint;
  result.model = joint.parameters->model(joint.fit.u);
  result.parameters = parameters_of(result, *joint.parameters, {});
  result.at_border = is_at_border(result.parameters);
  result.rms_mm =
      rms(distances_at_posterior(base, result.hypothesis, joint.fit.residuals).head(joint.fit.residuals.skin_rows()));
  result.held_out_rms_mm = held_out_rms(base, result.hypothesis, joint.fit.residuals);
}

}  // namespace

Refit refit(const calibration::MeasuredScene& scene, const simulation::Model& given, const BaseFit& base,
            const JointFit& from, const std::vector<Candidate>& candidates, const Hypothesis& screened) {
  Refit result;
  result.effects = names_of(screened, candidates);
  result.joint = unfitted(given, base, from, result.effects);
  result.joint.size_mm = base.size_of(screened.weighed);
  if (find_fit(scene, base, from, candidates, screened, result)) tell_of(base, result);
  return result;
}

Refit refit_again(const calibration::MeasuredScene& scene, const BaseFit& ground, const Refit& before) {
  Refit result;
  result.effects = before.effects;
  result.joint = before.joint;
  result.hypothesis = before.hypothesis;
  try {
    fit_set(scene, ground, before.joint.fit.u, &before.joint.fit.prediction.solution, result.joint, result.hypothesis);
    result.solved = true;
  } catch (const NumericalFailure&) {
    return result;  // under these errors it leads where there is no equilibrium
  }
  result.hypothesis.again = true;
  result.hypothesis.screened = result.hypothesis.ln_evidence;
  tell_of(ground, result);
  return result;
}

Refit refit_within(const calibration::MeasuredScene& scene, const simulation::Model& given, const BaseFit& ground,
                   const Refit& whole, const std::vector<Candidate>& candidates, const Hypothesis& part) {
  Refit result;
  result.effects = names_of(part, candidates);
  JointFit& joint = result.joint = unfitted(given, ground, whole.joint, result.effects);
  // Effects that are left out may have replaced what is never known.
  for (const Nuisance& nuisance : unfitted(given, ground, ground, result.effects).nuisances)
    if (std::none_of(joint.nuisances.begin(), joint.nuisances.end(),
                     [&nuisance](const Nuisance& has) { return has.name() == nuisance.name(); }))
      joint.nuisances.push_back(nuisance);
  joint.size_mm = ground.size_of(whole.hypothesis.weighed);
  result.hypothesis = part;
  try {
    const VectorXd start = start_of(*joint.parameters, whole.joint, candidates, part);
    fit_set(scene, ground, start, &whole.joint.fit.prediction.solution, joint, result.hypothesis);
    result.solved = true;
  } catch (const NumericalFailure&) {
    return result;  // it cannot do without them
  }
  result.hypothesis.again = true;
  result.hypothesis.screened = result.hypothesis.ln_evidence;
  tell_of(ground, result);
  return result;
}

double promised_without(const Refit& refit, const Candidate& effect) {
  const LinearEvidence& evidence = *refit.hypothesis.evidence;
  const Directions& all = evidence.directions();
  VectorXd distances = evidence.distances();
  std::vector<int> others;
  for (const int row : refit.hypothesis.rows) {
    const std::string& name = all.names[static_cast<std::size_t>(row)];
    if (!name.starts_with(effect.effect + ".")) others.push_back(row);
    for (const CandidateParameter& number : effect.parameters)
      if (number.name == name) distances += (number.null - all.stands[row]) / all.unit[row] * all.columns.col(row);
  }
  return LinearEvidence(evidence.errors(), distances, all).weigh(others).ln_evidence;
}

bool does_nothing(const Refit& refit, const Candidate& candidate) {
  return std::all_of(candidate.parameters.begin(), candidate.parameters.end(), [&refit](const CandidateParameter& p) {
    const auto fitted = std::find_if(refit.parameters.begin(), refit.parameters.end(),
                                     [&p](const FittedParameter& f) { return f.name == p.name; });
    return fitted != refit.parameters.end() && fitted->low < p.null && p.null < fitted->high;
  });
}

double find_strength_densities(const calibration::MeasuredScene& scene, const std::vector<Candidate>& candidates,
                               Refit& refit) {
  if (!refit.solved || refit.has_densities) return 0;
  refit.has_densities = true;
  const BaseFit& ground = *refit.hypothesis.ground;
  const JointFit& joint = refit.joint;
  const FreeParameters there(with_nuisances(joint.parameters->base(), joint.nuisances, poses_of(scene)));
  const FitErrors errors(ground, joint.nuisances, joint.size_mm);
  const double before = refit.hypothesis.ln_evidence;
  const Curved curved = curved_strengths({scene, ground, errors.metric(), joint.nuisances}, candidates, there, refit);
  if (!curved.empty()) refit.parameters = parameters_of(refit, there, curved);
  return refit.hypothesis.ln_evidence - before;
}

}  // namespace supine::diagnosis
