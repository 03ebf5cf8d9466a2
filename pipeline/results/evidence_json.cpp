// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/evidence_json.h"

#include <algorithm>
#include <cmath>

#include "common/rms.h"
#include "common/statistics.h"
#include "diagnosis/over_sets.h"
#include "diagnosis/size_named.h"
#include "simulation/parameters.h"

namespace supine::pipeline {
namespace {

using diagnosis::Findings;
using diagnosis::Refit;
using diagnosis::Score;
using diagnosis::Verdict;
using Json = nlohmann::ordered_json;

/// Of the most probable set that was refitted and holds the effect.
const Refit* refit_of(const Findings& found, const std::string& effect) {
  for (const Refit& refit : found.refits)
    if (refit.solved && std::find(refit.effects.begin(), refit.effects.end(), effect) != refit.effects.end())
      return &refit;
  return nullptr;
}

std::vector<std::string> rivals_of(const Findings& found, const std::string& effect) {
  std::vector<std::string> names;
  if (found.diagnosis.verdict != Verdict::ambiguous) return names;
  const auto& set = found.diagnosis.missing;
  if (std::find(set.begin(), set.end(), effect) == set.end()) return names;
  for (const std::string& other : set)
    if (other != effect) names.push_back(other);
  return names;
}

/// Of the refit where there is one, else of the linear step.
Json parameters_json(const diagnosis::Candidate& candidate, const Score& score, const Refit* refit) {
  Json list = Json::array();
  if (refit != nullptr) {
    for (const auto& p : refit->parameters)
      if (p.name.starts_with(candidate.effect + "."))
        list.push_back({{"name", p.name},
                        {"value", p.value},
                        {"unit", p.unit},
                        {"interval95", {p.low, p.high}},
                        {"at_bound", p.end != diagnosis::RangeEnd::none}});
    return list;
  }
  for (Eigen::Index k = 0; k < score.step.size(); ++k) {
    const auto& p = candidate.parameters[static_cast<std::size_t>(k)];
    const double reach = normal_reach95() * score.step_sd[k];
    list.push_back({{"name", p.name},
                    {"value", score.step[k]},
                    {"unit", p.unit},
                    {"interval95", {score.step[k] - reach, score.step[k] + reach}}});
  }
  return list;
}

Json finite_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json candidate_json(const Findings& found, const Score& score) {
  const Refit* refit = refit_of(found, score.effect);
  return {{"effect", score.effect},
          {"probability", found.included_of(score.effect).probability},
          {"p_value", score.p_value},
          {"predicted_rms_mm", score.predicted_rms_mm},
          {"refit_rms_mm", refit ? Json(refit->rms_mm) : Json(nullptr)},
          {"held_out_rms_mm", refit ? refit->held_out_rms_mm : score.predicted_held_out_rms_mm},
          {"parameters", parameters_json(candidate_of(found, score.effect), score, refit)},
          {"not_told_apart_from", rivals_of(found, score.effect)},
          {"same_shape_as", score.not_told_apart_from},
          {"statistic", score.statistic},
          {"freedom", score.freedom},
          {"at_border", refit ? Json(refit->at_border) : Json(nullptr)},
          {"wrong_sign", score.wrong_sign},
          {"beyond_range", score.beyond_range},
          {"predicted_held_out_rms_mm", score.predicted_held_out_rms_mm},
          {"noncentrality", score.noncentrality},
          {"power", score.power},
          {"named_half_at", finite_json(diagnosis::size_named(found, score, 0.5))},
          {"named_mostly_at", finite_json(diagnosis::size_named(found, score, 0.9))}};
}

Json names_of(const Findings& found, const diagnosis::Hypothesis& h) {
  Json names = Json::array();
  for (const int effect : h.effects) names.push_back(found.candidates[static_cast<std::size_t>(effect)].effect);
  return names;
}

/// 1 sigma of a number where the effect is not missing: that of the nuisance which the effect replaces, else 0.
double null_sd(const Findings& found, const std::string& number) {
  for (const diagnosis::Nuisance& nuisance : found.base.nuisances)
    if (nuisance.name() == "/" + number) return nuisance.sigma;
  return 0;
}

/// Offset of a number from its null and how well it is known, from the refit of its effect alone where there is one.
std::optional<std::pair<double, double>> known_of(const diagnosis::Hypothesis& h, const Refit* refit,
                                                  const diagnosis::CandidateParameter& p) {
  if (refit != nullptr && refit->solved) {
    const auto fitted = std::find_if(refit->parameters.begin(), refit->parameters.end(),
                                     [&p](const diagnosis::FittedParameter& f) { return f.name == p.name; });
    if (fitted == refit->parameters.end()) return {};
    return {{fitted->value - p.null, (fitted->high - fitted->low) / (2 * normal_reach95())}};
  }
  const int place = h.place_of(p.name);
  if (place < 0) return {};
  return h.weighed.number(place);
}

Json numbers_of_single(const Findings& found, const diagnosis::Hypothesis& h) {
  const diagnosis::Candidate& candidate = found.candidates[static_cast<std::size_t>(h.effects.front())];
  const Refit* refit = found.refit_of({candidate.effect});
  Json numbers = Json::array();
  for (std::size_t k = 0; k < candidate.parameters.size(); ++k) {
    const diagnosis::CandidateParameter& p = candidate.parameters[k];
    const auto known = known_of(h, refit, p);
    if (!known) continue;
    const auto prior = diagnosis::strength_prior(*simulation::find_parameter(p.name));
    const Eigen::VectorXd usual =
        candidate.secant.size() > 0
            ? candidate.secant
            : Eigen::VectorXd(candidate.slope.col(static_cast<Eigen::Index>(k)) * (p.typical - p.null));
    numbers.push_back(
        {{"name", p.name},
         {"mean", known->first},
         {"sd", known->second > 0 ? Json(known->second) : Json(nullptr)},  // none: cut at one end of the range
         {"prior_mean", prior.mean() - p.null},
         {"prior_sd", prior.sd()},
         {"null_sd", null_sd(found, p.name)},
         {"usual", p.typical - p.null},
         {"usual_moves_mm", rms(usual)}});
  }
  return numbers;
}

}  // namespace

const diagnosis::Candidate& candidate_of(const Findings& found, const std::string& effect) {
  return *std::find_if(found.candidates.begin(), found.candidates.end(),
                       [&effect](const diagnosis::Candidate& c) { return c.effect == effect; });
}

Json candidates_json(const Findings& found) {
  Json list = Json::array();
  for (const diagnosis::Inclusion& one : found.included)
    for (const Score& score : found.table.scores)
      if (score.effect == one.effect) list.push_back(candidate_json(found, score));
  return list;
}

Json hypotheses_json(const Findings& found) {
  Json list = Json::array();
  for (const auto& [one, left] : found.told())
    list.push_back({{"effects", names_of(found, *one)},
                    {"probability", one->probability},
                    {"refitted", one->refitted || one->effects.empty()},
                    {"unexplained_mm", left.mean_mm},
                    {"unexplained95", {left.low_mm, left.high_mm}}});
  return list;
}

Json unlisted_json(const diagnosis::Unlisted& found) {
  Json kinds = Json::object();
  for (std::size_t kind = 0; kind < diagnosis::local_kinds; ++kind)
    kinds[diagnosis::local_kind_name(static_cast<diagnosis::LocalKind>(kind))] = found.by_kind[kind];
  const bool moved = found.kind == diagnosis::LocalKind::muscle;
  const auto value = [moved](double size) { return moved ? size : std::exp(size); };
  Json effect;
  if (found.effect) {
    effect["name"] = found.effect->name;
    for (const auto& [name, number] : found.effect->parameters) effect[name] = number.value;
    for (const auto& [name, option] : found.effect->options) effect[name] = option;
  }
  return {{"probability", found.probability},
          {"effect", effect},
          {"by_kind", kinds},
          {"likeliest", diagnosis::local_kind_name(found.kind)},
          {"place_mm", {found.place_mm.x(), found.place_mm.y(), found.place_mm.z()}},
          {"within_mm", found.within_mm},
          {moved ? "moved_mm" : "times_as_stiff", value(found.size)},
          {"interval95", {value(found.low), value(found.high)}}};
}

Json singles_json(const Findings& found) {
  const auto nothing = std::find_if(found.hypotheses.begin(), found.hypotheses.end(),
                                    [](const diagnosis::Hypothesis& h) { return h.effects.empty(); });
  Json list = Json::array();
  for (const diagnosis::Hypothesis& h : found.hypotheses)
    if (h.effects.size() == 1)
      list.push_back({{"effect", found.candidates[static_cast<std::size_t>(h.effects.front())].effect},
                      {"ln_bayes_factor", h.ln_evidence - nothing->ln_evidence},
                      {"numbers", numbers_of_single(found, h)}});
  return list;
}

Json included_json(const Findings& found) {
  Json list = Json::array();
  for (const diagnosis::Inclusion& one : found.included) {
    Json numbers = Json::array();
    for (const diagnosis::FittedParameter& p : diagnosis::over_sets(found, one.effect))
      numbers.push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"interval95", {p.low, p.high}}});
    list.push_back({{"effect", one.effect},
                    {"probability", one.probability},
                    {"bayes_factor", one.bayes_factor},
                    {"left_out_gain", one.left_out_gain},
                    {"ends_at", one.ends_at},
                    {"numbers", numbers}});
  }
  return list;
}

Json other_priors_json(const Findings& found) {
  Json list = Json::array();
  for (const diagnosis::OtherPrior& other : found.under_other_priors) {
    Json included = Json::object();
    for (const diagnosis::Inclusion& i : other.included) included[i.effect] = i.probability;
    list.push_back({{"what", other.what},
                    {"verdict", diagnosis::verdict_name(other.diagnosis.verdict)},
                    {"missing", other.diagnosis.missing},
                    {"included", included}});
  }
  return list;
}

}  // namespace supine::pipeline
