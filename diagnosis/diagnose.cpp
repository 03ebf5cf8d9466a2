// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnose.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "diagnosis/score_test.h"
#include "simulation/catalogue.h"

namespace supine::diagnosis {
namespace {

constexpr double held_by_the_set = 0.95;
constexpr double nothing_unlikely = 0.5, nothing_excluded = 0.25, speaks_against = -3;
constexpr std::size_t most_named = 6;

/// Neither an effect nor a local cause that is not listed.
double probability_of_nothing(const std::vector<Hypothesis>& hypotheses) {
  double sum = 0;
  for (const Hypothesis& h : hypotheses) {
    if (!h.effects.empty()) continue;
    double alone = 1;
    for (const double share : h.with_unlisted) alone -= share;
    sum += h.probability * std::max(0.0, alone);
  }
  return sum;
}

double probability_of_some_effect(const std::vector<Hypothesis>& hypotheses) {
  double sum = 0;
  for (const Hypothesis& h : hypotheses)
    if (!h.effects.empty()) sum += h.probability;
  return sum;
}

double probability_of_unlisted(const std::vector<Hypothesis>& hypotheses) {
  double sum = 0;
  for (const Hypothesis& h : hypotheses)
    for (const double share : h.with_unlisted) sum += h.probability * share;
  return sum;
}

bool is_measurement(const std::string& effect) {
  const auto kind = simulation::traits_of(effect).kind;
  return kind == simulation::EffectKind::measurement || kind == simulation::EffectKind::numerical;
}

/// Whether a local cause has a Bayes factor of settling_factor or more.
bool is_likelier_than_before(double now, double before) {
  return before > 0 && now / std::max(1 - now, 1e-9) >= settling_factor * before / (1 - before);
}

/// Expected, and neither found nor excluded.
bool is_left_open(const Priors& priors, const Inclusion& one) {
  return priors.is_expected(one.effect) && one.probability > 1 - priors.named_at;
}

/// Effects of the smallest set of hypotheses that holds 95 %, of these those that pass; measurement causes first, then
/// the likelier.
template <class Pass>
std::vector<std::string> likely_effects(const std::vector<Hypothesis>& hypotheses,
                                        const std::vector<std::string>& effects, const std::vector<Inclusion>& included,
                                        Pass pass) {
  std::set<std::string> held;
  double sum = 0;
  for (const Hypothesis& h : hypotheses) {
    for (const int effect : h.effects) held.insert(effects[static_cast<std::size_t>(effect)]);
    sum += h.probability;
    if (sum >= held_by_the_set) break;
  }
  std::vector<std::string> named;
  for (const Inclusion& one : included)
    if (held.contains(one.effect) && pass(one) && named.size() < most_named) named.push_back(one.effect);
  std::stable_sort(named.begin(), named.end(),
                   [](const std::string& a, const std::string& b) { return is_measurement(a) && !is_measurement(b); });
  return named;
}

}  // namespace

std::string verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::nothing_missing:
      return "nothing_missing";
    case Verdict::missing:
      return "missing";
    case Verdict::ambiguous:
      return "ambiguous";
    default:
      return "unexplained";
  }
}

std::vector<Inclusion> inclusions(const std::vector<Hypothesis>& hypotheses, const std::vector<std::string>& effects,
                                  const Priors& priors) {
  std::vector<Inclusion> list;
  for (std::size_t e = 0; e < effects.size(); ++e) {
    constexpr double least = 1e-9;
    const double p = inclusion(hypotheses, static_cast<int>(e)), other = std::max(1 - p, least);
    const double before = priors.of_effect(effects, effects[e]);
    list.push_back({effects[e], p, (p / other) / (before / (1 - before))});
  }
  std::stable_sort(list.begin(), list.end(),
                   [](const Inclusion& a, const Inclusion& b) { return a.probability > b.probability; });
  return list;
}

Diagnosis decide(const std::vector<Hypothesis>& hypotheses, const std::vector<std::string>& effects,
                 const std::vector<Inclusion>& included, const Unexplained& unexplained, const Priors& priors,
                 const std::vector<std::string>& unseen) {
  Diagnosis result;
  const double nothing = probability_of_nothing(hypotheses), local = probability_of_unlisted(hypotheses);
  std::vector<std::string> denied;
  std::vector<Inclusion> at_end;
  for (const Inclusion& one : included) {
    if (one.probability < priors.named_at) continue;
    if (!one.ends_at.empty())
      at_end.push_back(one);
    else
      (one.left_out_gain > speaks_against ? result.missing : denied).push_back(one.effect);
  }
  if (!result.missing.empty()) {
    result.verdict = Verdict::missing;
    result.ambiguous_rest = likely_effects(hypotheses, effects, included, [&](const Inclusion& one) {
      return (one.probability < priors.named_at || !one.ends_at.empty()) &&
             (one.bayes_factor >= settling_factor || is_left_open(priors, one));
    });
    result.why = fmt::format("probability {:.2f} or more", priors.named_at);
    return result;
  }
  if (!at_end.empty()) {
    result.verdict = Verdict::unexplained;
    result.missing = {at_end.front().effect};
    result.why = fmt::format("{} would have to be at the end of its range: something else, that looks like it",
                             at_end.front().ends_at);
    return result;
  }
  if (local >= priors.named_at) {
    result.verdict = Verdict::unexplained;
    if (!included.empty()) result.missing = {included.front().effect};
    result.ambiguous_rest = likely_effects(hypotheses, effects, included,
                                           [](const Inclusion& one) { return one.bayes_factor >= settling_factor; });
    result.why = fmt::format("a local cause that the catalogue does not list has probability {:.2f}", local);
    return result;
  }
  const bool some = !included.empty() && included.front().probability > 0 &&
                    std::any_of(included.begin(), included.end(), [&](const Inclusion& one) {
                      const bool likelier_than_nothing = priors.is_expected(one.effect) && one.probability > nothing;
                      return one.bayes_factor >= settling_factor || likelier_than_nothing;
                    });
  std::vector<std::string> undecided;
  for (const Inclusion& one : included)
    if (is_left_open(priors, one) && std::find(unseen.begin(), unseen.end(), one.effect) != unseen.end())
      undecided.push_back(one.effect);
  const bool locally = is_likelier_than_before(local, priors.unlisted);
  const bool likely = ((some || locally) && nothing < nothing_unlikely) || nothing < nothing_excluded;
  if (likely && locally && denied.empty() && undecided.empty() && local > probability_of_some_effect(hypotheses)) {
    result.verdict = Verdict::unexplained;
    if (!included.empty()) result.missing = {included.front().effect};
    result.why = fmt::format(
        "something local that the catalogue does not list has probability {:.2f}, that nothing is missing {:.2f}",
        local, nothing);
    return result;
  }
  if (likely || !undecided.empty()) {
    result.verdict = Verdict::ambiguous;
    const bool expected =
        std::any_of(included.begin(), included.end(), [&](const Inclusion& one) { return is_left_open(priors, one); });
    result.missing = likely_effects(hypotheses, effects, included, [&](const Inclusion& one) {
      return (!some && !expected) || one.bayes_factor >= settling_factor || is_left_open(priors, one);
    });
    result.why = denied.empty() ? fmt::format("that nothing is missing has probability {:.2f}", nothing)
                                : fmt::format("what was left out speaks against {}", fmt::join(denied, ", "));
    if (!likely) result.why += fmt::format(", and this scan could not show {}", fmt::join(undecided, " or "));
    return result;
  }
  if (unexplained.low_mm > priors.unexplained_bound_mm) {
    result.verdict = Verdict::unexplained;
    if (!included.empty()) result.missing = {included.front().effect};
    result.why = fmt::format("{:.1f} mm [{:.1f}, {:.1f}] are explained by no effect of the catalogue",
                             unexplained.mean_mm, unexplained.low_mm, unexplained.high_mm);
    return result;
  }
  result.ambiguous_rest =
      likely_effects(hypotheses, effects, included, [&](const Inclusion& one) { return is_left_open(priors, one); });
  result.why = fmt::format("probability {:.2f}", nothing);
  return result;
}

}  // namespace supine::diagnosis
