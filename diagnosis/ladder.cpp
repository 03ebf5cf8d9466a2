// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/ladder.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"

namespace supine::diagnosis {
namespace {

Rung rung_of(const Findings& found, const std::string& added) {
  const double p = found.table.scores.empty() ? 1 : found.table.scores.front().p_value;
  return {added,
          found.base.fit.residuals.distance_mm.cwiseAbs().mean(),
          found.figures.rms_mm,
          found.figures.held_out_rms_mm,
          found.figures.pose_rms_mm,
          p};
}

/// One of the refits that were not chosen.
Rung random_other(const Findings& found, unsigned seed) {
  std::vector<const Refit*> others;
  const auto& chosen = found.diagnosis.missing;
  for (const Refit& refit : found.refits)
    if (refit.solved && std::find(chosen.begin(), chosen.end(), refit.effect) == chosen.end()) others.push_back(&refit);
  if (others.empty()) return {};
  std::mt19937 generator(seed);
  const Refit& refit = *others[generator() % others.size()];
  return {refit.effect,      refit.fit.fit.residuals.distance_mm.cwiseAbs().mean(),
          refit.rms_mm,      refit.held_out_rms_mm,
          refit.pose_rms_mm, 1};
}

const Refit* chosen_refit(const Findings& found) {
  if (found.diagnosis.verdict != Verdict::missing) return nullptr;
  for (const Refit& refit : found.refits)
    if (refit.effect == found.diagnosis.missing[0]) return &refit;
  return nullptr;
}

}  // namespace

Ladder climb(const Subject& subject, const ExamineOptions& options, const Findings& first, int most) {
  Ladder ladder;
  ladder.rungs.push_back(rung_of(first, {}));
  ladder.random_other = random_other(first, options.seed);
  ladder.verdict = first.diagnosis.verdict;
  ladder.missing = first.diagnosis.missing;
  ladder.noise_floor_mm = std::hypot(first.figures.noise_mm, first.sources.spread_mm);
  ladder.model = first.model;
  std::unique_ptr<Findings> next;
  const Findings* found = &first;
  while (const Refit* refit = chosen_refit(*found)) {
    if (static_cast<int>(ladder.rungs.size()) > most) {
      ladder.stopped = "as many effects were added as are allowed";
      return ladder;
    }
    const std::string added = refit->effect;
    Subject with = subject;
    with.model = refit->model;
    with.near = &refit->fit.fit.prediction.solution;
    try {
      std::unique_ptr<Findings> after = examine(with, options);
      ladder.rungs.push_back(rung_of(*after, added));
      ladder.model = after->model;
      next = std::move(after);
    } catch (const NumericalFailure& failure) {
      ladder.stopped = "no equilibrium with " + added + ": " + failure.what();
      return ladder;
    }
    found = next.get();
  }
  ladder.stopped = verdict_name(found->diagnosis.verdict) + ": " + found->diagnosis.why;
  return ladder;
}

}  // namespace supine::diagnosis
