// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnose.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
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

/// What the verdict rests on.
struct Odds {
  Odds(const std::vector<Hypothesis>& sets, const std::vector<std::string>& names,
       const std::vector<Inclusion>& inclusion_of, const Unexplained& rest, const Priors& beliefs,
       const std::vector<std::string>& unseen)
      : hypotheses(sets), effects(names), included(inclusion_of), unexplained(rest), priors(beliefs) {
    nothing = probability_of_nothing(sets);
    local = probability_of_unlisted(sets);
    local_is_likelier = is_likelier_than_before(local, beliefs.unlisted);
    for (const Inclusion& one : included) {
      if (one.probability >= priors.named_at) likely_enough(one).push_back(&one);
      const bool open = is_left_open(priors, one);
      expected_is_open = expected_is_open || open;
      if (open && std::find(unseen.begin(), unseen.end(), one.effect) != unseen.end()) unsettled.push_back(one.effect);
      effect_is_likelier = effect_is_likelier || one.bayes_factor >= settling_factor ||
                           (priors.is_expected(one.effect) && one.probability > nothing);
    }
  }

  /// The list of what would be named that an effect belongs to.
  std::vector<const Inclusion*>& likely_enough(const Inclusion& one) {
    if (!one.ends_at.empty()) return at_end;
    return one.left_out_gain > speaks_against ? sure : denied;
  }

  /// Something is likelier than it was, and that nothing is missing is not.
  bool something_is_likely() const {
    return ((effect_is_likelier || local_is_likelier) && nothing < nothing_unlikely) || nothing < nothing_excluded;
  }

  template <class Pass>
  std::vector<std::string> likely(Pass pass) const {
    return likely_effects(hypotheses, effects, included, pass);
  }
  std::vector<std::string> best() const {
    return included.empty() ? std::vector<std::string>{} : std::vector<std::string>{included.front().effect};
  }

  const std::vector<Hypothesis>& hypotheses;
  const std::vector<std::string>& effects;
  const std::vector<Inclusion>& included;
  const Unexplained& unexplained;
  const Priors& priors;
  double nothing = 0, local = 0;
  bool effect_is_likelier = false, local_is_likelier = false, expected_is_open = false;
  std::vector<const Inclusion*> sure, denied, at_end;  // likely enough to be named; by what speaks against it
  std::vector<std::string> unsettled;                  // expected, and this scan could not show it
};

using Rule = std::optional<Diagnosis>;

Rule missing(const Odds& known) {
  if (known.sure.empty()) return {};
  Diagnosis result;
  result.verdict = Verdict::missing;
  for (const Inclusion* one : known.sure) result.missing.push_back(one->effect);
  result.ambiguous_rest = known.likely([&known](const Inclusion& one) {
    return (one.probability < known.priors.named_at || !one.ends_at.empty()) &&
           (one.bayes_factor >= settling_factor || is_left_open(known.priors, one));
  });
  result.why = fmt::format("probability {:.2f} or more", known.priors.named_at);
  return result;
}

Rule at_an_end(const Odds& known) {
  if (known.at_end.empty()) return {};
  const Inclusion& first = *known.at_end.front();
  return Diagnosis{
      Verdict::unexplained,
      {first.effect},
      {},
      fmt::format("{} would have to be at the end of its range: something else, that looks like it", first.ends_at)};
}

Rule surely_local(const Odds& known) {
  if (known.local < known.priors.named_at) return {};
  return Diagnosis{Verdict::unexplained, known.best(),
                   known.likely([](const Inclusion& one) { return one.bayes_factor >= settling_factor; }),
                   fmt::format("a local cause that the catalogue does not list has probability {:.2f}", known.local)};
}

Rule rather_local(const Odds& known) {
  const bool first = known.local > probability_of_some_effect(known.hypotheses);
  if (!known.something_is_likely() || !known.local_is_likelier || !first || !known.denied.empty() ||
      !known.unsettled.empty())
    return {};
  return Diagnosis{Verdict::unexplained,
                   known.best(),
                   {},
                   fmt::format("something local that the catalogue does not list has probability {:.2f}, that nothing "
                               "is missing {:.2f}",
                               known.local, known.nothing)};
}

Rule undecided(const Odds& known) {
  const bool likely = known.something_is_likely();
  if (!likely && known.unsettled.empty()) return {};
  Diagnosis result;
  result.verdict = Verdict::ambiguous;
  const bool any = !known.effect_is_likelier && !known.expected_is_open;
  result.missing = known.likely([&](const Inclusion& one) {
    return any || one.bayes_factor >= settling_factor || is_left_open(known.priors, one);
  });
  std::vector<std::string> denied;
  for (const Inclusion* one : known.denied) denied.push_back(one->effect);
  result.why = denied.empty() ? fmt::format("that nothing is missing has probability {:.2f}", known.nothing)
                              : fmt::format("what was left out speaks against {}", fmt::join(denied, ", "));
  if (!likely) result.why += fmt::format(", and this scan could not show {}", fmt::join(known.unsettled, " or "));
  return result;
}

Rule not_explained(const Odds& known) {
  const Unexplained& rest = known.unexplained;
  if (rest.low_mm <= known.priors.unexplained_bound_mm) return {};
  return Diagnosis{Verdict::unexplained,
                   known.best(),
                   {},
                   fmt::format("{:.1f} mm [{:.1f}, {:.1f}] are explained by no effect of the catalogue", rest.mean_mm,
                               rest.low_mm, rest.high_mm)};
}

Diagnosis nothing_missing(const Odds& known) {
  return {Verdict::nothing_missing,
          {},
          known.likely([&known](const Inclusion& one) { return is_left_open(known.priors, one); }),
          fmt::format("probability {:.2f}", known.nothing)};
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
  const Odds known(hypotheses, effects, included, unexplained, priors, unseen);
  for (const auto rule : {missing, at_an_end, surely_local, rather_local, undecided, not_explained})
    if (auto diagnosis = rule(known)) return *diagnosis;
  return nothing_missing(known);
}

}  // namespace supine::diagnosis
