// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/ladder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"
#include "common/rms.h"
#include "diagnosis/range_ends.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

RungFigures figures_of(const Findings& found, const std::string& added) {
  return {added, found.base.fit.residuals.skin_mm().cwiseAbs().mean(), found.rms_mm, found.held_out_rms_mm};
}

RungFigures figures_of(const Refit& refit) {
  return {refit.effects[0], refit.joint.fit.residuals.skin_mm().cwiseAbs().mean(), refit.rms_mm, refit.held_out_rms_mm};
}

Rung rung_of(const Findings& found, const std::string& added, double probability) {
  Rung rung;
  static_cast<RungFigures&>(rung) = figures_of(found, added);
  rung.probability = probability;
  for (const Score& score : found.table.scores) rung.p_value = std::min(rung.p_value, score.p_value);
  rung.unexplained = found.unexplained;
  rung.left = found.left_by_base;
  rung.model = found.base.parameters->model(found.base.fit.u);
  return rung;
}

/// Any effect but those that are missing, drawn by the seed, fitted. Of those without equilibrium the next is taken.
std::optional<RungFigures> random_other(const Subject& subject, const Findings& found, unsigned seed) {
  std::vector<int> others;
  const std::vector<std::string> names = found.effects();
  const auto& named = found.diagnosis.missing;
  for (int e = 0; e < static_cast<int>(names.size()); ++e)
    if (std::find(named.begin(), named.end(), names[static_cast<std::size_t>(e)]) == named.end()) others.push_back(e);
  std::mt19937 generator(seed);
  std::shuffle(others.begin(), others.end(), generator);
  for (const int effect : others) {
    if (const Refit* known = found.refit_of({names[static_cast<std::size_t>(effect)]})) return figures_of(*known);
    const auto screened = std::find_if(found.hypotheses.begin(), found.hypotheses.end(),
                                       [effect](const Hypothesis& h) { return h.effects == std::vector{effect}; });
    const Refit fitted = refit(subject.scene, subject.given, found.base, found.base, found.candidates, *screened);
    if (fitted.solved) return figures_of(fitted);
  }
  return {};
}

/// The model with the likeliest of what is missing added, numbers as some refit has them.
Subject with_effect(const Subject& subject, const Findings& found, const std::string& effect) {
  Subject with = subject;
  with.given.effects.push_back(free_setting(effect));
  with.start = with.given;
  const Refit* nearest = found.refit_of({effect});
  for (const Refit& refit : found.refits)
    if (nearest == nullptr && refit.solved &&
        std::find(refit.effects.begin(), refit.effects.end(), effect) != refit.effects.end())
      nearest = &refit;
  with.near = nullptr;
  if (nearest == nullptr) return with;
  simulation::Model fitted = nearest->model;
  for (const std::string& name : simulation::free_parameters(with.start))
    if (const auto* number = simulation::find_setting(fitted, name))
      simulation::find_setting(with.start, name)->value = number->value;
  with.near = &nearest->joint.fit.prediction.solution;
  return with;
}

}  // namespace

Ladder climb(const Subject& subject, const ExamineOptions& options, const Findings& first, int most) {
  Ladder ladder;
  ladder.rungs.push_back(rung_of(first, {}, 1));
  ladder.verdict = first.diagnosis.verdict;
  ladder.missing = first.diagnosis.missing;
  ladder.last = first.diagnosis;
  ladder.noise_floor_mm =
      std::hypot(rms(first.base.noise_of_point_mm), first.base.numerical ? first.base.numerical->spread_mm : 0);
  ladder.model = ladder.rungs.back().model;
  std::unique_ptr<Findings> next;
  const Findings* found = &first;
  Subject examined = subject;  // of `found`
  while (found->diagnosis.verdict == Verdict::missing) {
    if (static_cast<int>(ladder.rungs.size()) > most) {
      ladder.stopped = "as many effects were added as are allowed";
      return ladder;
    }
    const std::string added = found->diagnosis.missing[0];
    Subject with = with_effect(examined, *found, added);
    try {
      std::unique_ptr<Findings> after = examine(with, options);
      if (const auto ends = measurements_at_end(*after); !ends.empty()) {
        ladder.stopped = fmt::format("with {} the fit drives {} to an end of its range", added, ends.front().name);
        return ladder;
      }
      Rung rung = rung_of(*after, added, found->included.front().probability);
      rung.refit_only = figures_of(*found, ladder.rungs.back().added);
      rung.random_other = random_other(examined, *found, options.seed + static_cast<unsigned>(ladder.rungs.size()));
      ladder.last = after->diagnosis;
      ladder.model = rung.model;
      ladder.rungs.push_back(std::move(rung));
      next = std::move(after);
    } catch (const NumericalFailure& failure) {
      ladder.stopped = "no equilibrium with " + added + ": " + failure.what();
      return ladder;
    }
    found = next.get();
    examined = std::move(with);
    examined.near = nullptr;
  }
  ladder.stopped = verdict_name(found->diagnosis.verdict) + ": " + found->diagnosis.why;
  return ladder;
}

}  // namespace supine::diagnosis
