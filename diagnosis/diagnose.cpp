// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnose.h"

#include <algorithm>

namespace supine::diagnosis {
namespace {

constexpr double floor_factor = 1.1;  // held-out RMS within this of the noise: nothing is left to explain

bool is_measurement_effect(const std::string& effect) {
  return effect == "misregistration" || effect == "gravity_tilt" || effect == "segmentation_offset";
}

bool improves(double held_out_mm, double base_held_out_mm, const VerdictRules& rules) {
  const double fall = base_held_out_mm - held_out_mm;
  return fall >= rules.held_out_mm && fall >= rules.held_out_share * base_held_out_mm;
}

/// The best, and those that cannot be told from it: nearly as good a score, or the same direction and a fall as well.
std::vector<std::string> rivals(const ScoreTable& table, const Score& best, const VerdictRules& rules) {
  std::vector<std::string> set;
  const auto& twins = best.not_told_apart_from;
  for (const Score& score : table.scores) {
    if (!improves(score.predicted_held_out_rms_mm, table.base_held_out_rms_mm, rules)) continue;
    const bool twin = std::find(twins.begin(), twins.end(), score.effect) != twins.end();
    if (best.bic - score.bic < rules.bic || (twin && score.bic > 0)) set.push_back(score.effect);
  }
  std::stable_partition(set.begin(), set.end(), is_measurement_effect);
  return set;
}

/// Nothing was named: because nothing is left, or because nothing fits?
void leave_open(FirstDiagnosis& result, double noise_mm, const VerdictRules& rules) {
  const ScoreTable& t = result.table;
  const bool significant = !t.scores.empty() && t.scores.front().p_value < rules.p_value;
  if (!significant || t.base_held_out_rms_mm <= floor_factor * noise_mm) return;
  result.verdict = Verdict::unexplained;
  result.missing = {t.scores.front().effect};
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
    case Verdict::unexplained:
      return "unexplained";
  }
  return {};
}

FirstDiagnosis decide(ScoreTable table, ScoreTable white, std::vector<std::string> unseen, double noise_mm,
                      const VerdictRules& rules) {
  FirstDiagnosis result{Verdict::nothing_missing, {}, std::move(table), std::move(white), std::move(unseen), {}};
  const ScoreTable& t = result.table;
  const auto accepted = std::find_if(t.scores.begin(), t.scores.end(), [&t, &rules](const Score& s) {
    return s.p_value < rules.p_value && improves(s.predicted_held_out_rms_mm, t.base_held_out_rms_mm, rules);
  });
  if (accepted != t.scores.end()) {
    result.missing = rivals(t, *accepted, rules);
    result.verdict = result.missing.size() == 1 ? Verdict::missing : Verdict::ambiguous;
    return result;
  }
  leave_open(result, noise_mm, rules);
  return result;
}

FirstDiagnosis decide(ScoreTable table, ScoreTable white, std::vector<std::string> unseen, std::vector<Refit> refits,
                      double noise_mm, const VerdictRules& rules) {
  FirstDiagnosis result{Verdict::nothing_missing, {}, std::move(table), std::move(white), std::move(unseen),
                        std::move(refits)};
  const ScoreTable& t = result.table;
  const auto by_chance = [&t, &rules](const std::string& effect) {
    for (const Score& score : t.scores)
      if (score.effect == effect) return score.p_value >= rules.p_value;
    return true;
  };
  std::vector<Refit> good;
  for (const Refit& refit : result.refits)
    if (refit.solved && !by_chance(refit.effect) && improves(refit.held_out_rms_mm, t.base_held_out_rms_mm, rules))
      good.push_back(refit);
  std::stable_sort(good.begin(), good.end(),
                   [](const Refit& a, const Refit& b) { return a.held_out_rms_mm < b.held_out_rms_mm; });
  for (const Refit& refit : good)
    if (refit.held_out_rms_mm <= (1 + rules.rival_share) * good.front().held_out_rms_mm)
      result.missing.push_back(refit.effect);
  std::stable_partition(result.missing.begin(), result.missing.end(), is_measurement_effect);
  if (result.missing.empty())
    leave_open(result, noise_mm, rules);
  else
    result.verdict = result.missing.size() == 1 ? Verdict::missing : Verdict::ambiguous;
  return result;
}

}  // namespace supine::diagnosis
