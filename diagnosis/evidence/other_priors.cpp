// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/other_priors.h"

#include <algorithm>
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
std::vector<Hypothesis> weighed_again(std::vector<Hypothesis> hypotheses, const ErrorCovariance& errors,
                                      double factor) {
  std::map<const LinearEvidence*, LinearEvidence> others;
  for (Hypothesis& h : hypotheses) {
    if (h.probability < worth_weighing && !h.effects.empty()) continue;
    auto at = others.find(h.evidence.get());
    if (at == others.end())
      at = others
               .try_emplace(h.evidence.get(), errors, h.evidence->distances(),
                            with_strengths(h.evidence->directions(), factor))
               .first;
    h.ln_evidence += at->second.weigh(h.rows).ln_evidence - h.weighed.ln_evidence;
  }
  normalise(hypotheses);
  return hypotheses;
}

/// With what was left out as it was asked before.
std::vector<Inclusion> included_in(const std::vector<Hypothesis>& hypotheses, const std::vector<std::string>& effects,
                                   const std::vector<Inclusion>& before, const Priors& priors) {
  std::vector<Inclusion> list = inclusions(hypotheses, effects, priors);
  for (Inclusion& one : list)
    one.left_out_gain = std::find_if(before.begin(), before.end(), [&one](const Inclusion& other) {
                          return other.effect == one.effect;
                        })->left_out_gain;
  return list;
}

}  // namespace

std::vector<OtherPrior> under_other_priors(const BaseFit& base, const std::vector<Hypothesis>& hypotheses,
                                           const std::vector<std::string>& effects,
                                           const std::vector<Inclusion>& included, const Unexplained& unexplained,
                                           const Priors& priors, const std::vector<std::string>& unseen) {
  std::vector<OtherPrior> list;
  const auto add = [&](const std::string& what, const ErrorCovariance& errors, double factor) {
    const std::vector<Hypothesis> again = weighed_again(hypotheses, errors, factor);
    list.push_back(
        {what, decide(again, effects, included_in(again, effects, included, priors), unexplained, priors, unseen)});
  };
  add("strengths half as wide", *base.covariance, 0.5);
  add("strengths twice as wide", *base.covariance, 2);
  for (const double factor : {0.5, 2.0}) {
    const ErrorCovariance errors(base.errors, base.kernel, factor * base.scale_mm, base.most_mm);
    add(factor < 1 ? "the unexplained half as large" : "the unexplained twice as large", errors, 1);
  }
  return list;
}

}  // namespace supine::diagnosis
