// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/other_priors.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

constexpr double worth_weighing = 1e-3;  // of the probability

bool is_strength(const std::string& name) {
  if (name.find('/') != std::string::npos) return false;  // a nuisance
  const simulation::Parameter* row = simulation::find_parameter(name);
  return simulation::find_effect(name.substr(0, name.find('.'))) != nullptr && row != nullptr && !row->shape;
}

Directions with_strengths(Directions all, double factor) {
  for (Eigen::Index k = 0; k < all.size(); ++k)
    if (is_strength(all.names[static_cast<std::size_t>(k)])) all.sd[k] *= factor;
  return all;
}

/// The hypotheses with the evidence they would have.
/// @param factor, scale_factor  of the widths of strengths, of the scale of what is unexplained
std::vector<Hypothesis> weighed_again(std::vector<Hypothesis> hypotheses, double factor, double scale_factor) {
  std::map<const BaseFit*, ErrorCovariance> errors;
  std::map<const LinearEvidence*, LinearEvidence> others;
  for (Hypothesis& h : hypotheses) {
    if (h.probability < worth_weighing && !h.effects.empty()) continue;
    const BaseFit& ground = *h.ground;
    const auto under =
        errors.try_emplace(&ground, ground.errors, ground.kernel, scale_factor * ground.scale_mm, ground.most_mm).first;
    auto at = others.find(h.evidence.get());
    if (at == others.end())
      at = others
               .try_emplace(h.evidence.get(), under->second, h.evidence->distances(),
                            with_strengths(h.evidence->directions(), factor))
               .first;
    h.ln_evidence += at->second.weigh(h.rows).ln_evidence - h.weighed.ln_evidence;
  }
  normalise(hypotheses);
  return hypotheses;
}

/// What a local cause adds to a hypothesis, of each kind the square root of what it gains.
void halve_unlisted(double prior, Hypothesis& h) {
  if (!(prior > 0)) return;
  const double each = prior / static_cast<double>(local_kinds), before = std::exp(h.ln_unlisted);
  double sum = 1 - prior;
  for (double& share : h.with_unlisted) sum += share = std::sqrt(share * before * each);
  h.ln_unlisted = std::log(sum);
  for (double& share : h.with_unlisted) share /= sum;
}

/// With what was left out, and ends of ranges, as they were asked for before.
std::vector<Inclusion> included_in(const std::vector<Hypothesis>& hypotheses, const std::vector<std::string>& effects,
                                   const std::vector<Inclusion>& before, const Priors& priors) {
  std::vector<Inclusion> list = inclusions(hypotheses, effects, priors);
  for (Inclusion& one : list) {
    const auto& as_before = *std::find_if(before.begin(), before.end(),
                                          [&one](const Inclusion& other) { return other.effect == one.effect; });
    one.left_out_gain = as_before.left_out_gain, one.ends_at = as_before.ends_at;
  }
  return list;
}

}  // namespace

std::vector<Hypothesis> half_believed(std::vector<Hypothesis> hypotheses, const Priors& priors) {
  for (Hypothesis& h : hypotheses) {
    const double of_errors = h.ground != nullptr ? h.ground->ln_weight : 0;  // which stays in the weight of h
    h.ln_evidence = (h.ln_evidence + of_errors) / 2 - of_errors;
    halve_unlisted(priors.unlisted, h);
  }
  normalise(hypotheses);
  return hypotheses;
}

std::vector<OtherPrior> under_other_priors(const std::vector<Hypothesis>& hypotheses,
                                           const std::vector<std::string>& effects,
                                           const std::vector<Inclusion>& included, const Unexplained& unexplained,
                                           const Priors& priors, const std::vector<std::string>& unseen) {
  std::vector<OtherPrior> list;
  const auto add = [&](const std::string& what, const std::vector<Hypothesis>& again) {
    std::vector<Inclusion> then = included_in(again, effects, included, priors);
    Diagnosis diagnosis = decide(again, effects, then, unexplained, priors, unseen);
    list.push_back({what, std::move(diagnosis), std::move(then)});
  };
  add("strengths half as wide", weighed_again(hypotheses, 0.5, 1));
  add("strengths twice as wide", weighed_again(hypotheses, 2, 1));
  add("the unexplained half as large", weighed_again(hypotheses, 1, 0.5));
  add("the unexplained twice as large", weighed_again(hypotheses, 1, 2));
  add("the scans counting for half", half_believed(hypotheses, priors));
  list.back().of_prior = false;
  return list;
}

}  // namespace supine::diagnosis
