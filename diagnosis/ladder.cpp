// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/ladder.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"

namespace supine::diagnosis {
namespace {

RungFigures figures_of(const Findings& found, const std::string& added) {
  return {added, found.base.solution.residuals.distance_mm.cwiseAbs().mean(), found.figures.rms_mm,
          found.figures.held_out_rms_mm, found.figures.pose_rms_mm};
}

Rung rung_of(const Findings& found, const std::string& added) {
  const double p = found.table.scores.empty() ? 1 : found.table.scores.front().p_value;
  return {figures_of(found, added), p, {}, {}, found.model};
}

RungFigures figures_of(const Refit& refit) {
  return {refit.effect, refit.fit.solution.residuals.distance_mm.cwiseAbs().mean(), refit.rms_mm, refit.held_out_rms_mm,
          refit.pose_rms_mm};
}

/// Any effect but those that are blamed, drawn by the seed: one that was refitted for the verdict serves, else it is
/// refitted here. Of those without equilibrium the next is taken.
std::optional<RungFigures> random_other(const Subject& subject, const Findings& found, unsigned seed) {
  const auto& chosen = found.diagnosis.missing;
  std::vector<std::string> others;
  for (const Candidate& candidate : found.candidates)
    if (std::find(chosen.begin(), chosen.end(), candidate.effect) == chosen.end()) others.push_back(candidate.effect);
  std::mt19937 generator(seed);
  std::shuffle(others.begin(), others.end(), generator);
  const RefitProblem problem = refit_problem(subject, found, {});
  for (const std::string& effect : others) {
    for (const Refit& refit : found.refits)
      if (refit.effect == effect && refit.finished) return figures_of(refit);
    const auto refits = refit_candidates(problem, found.candidates, found.table, {effect});
    if (!refits.empty() && refits[0].solved) return figures_of(refits[0]);
  }
  return {};
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
  ladder.verdict = first.diagnosis.verdict;
  ladder.missing = first.diagnosis.missing;
  ladder.last = first.diagnosis;
  ladder.noise_floor_mm = std::hypot(first.figures.noise_mm, first.sources.spread_mm);
  ladder.model = first.model;
  ExamineOptions every_rung = options;
  every_rung.correct_quiet_poses = true;  // the last rung is quiet, and is compared with those before
  std::unique_ptr<Findings> next;
  const Findings* found = &first;
  Subject examined = subject;  // of `found`
  while (const Refit* refit = chosen_refit(*found)) {
    if (static_cast<int>(ladder.rungs.size()) > most) {
      ladder.stopped = "as many effects were added as are allowed";
      return ladder;
    }
    if (ladder.rungs.size() > 1 && refit->held_out_rms_mm >= found->figures.held_out_rms_mm) {
      ladder.stopped = refit->effect + " would be next by its p, but the held-out error does not fall with it";
      return ladder;
    }
    const std::string added = refit->effect;
    Subject with = examined;
    with.model = refit->model;
    with.near = &refit->fit.solution.prediction.solution;
    try {
      std::unique_ptr<Findings> after = examine(with, every_rung);
      Rung rung = rung_of(*after, added);
      rung.refit_only = figures_of(*found, ladder.rungs.back().added);
      rung.random_other = random_other(examined, *found, options.seed + static_cast<unsigned>(ladder.rungs.size()));
      ladder.rungs.push_back(std::move(rung));
      ladder.last = after->diagnosis;
      ladder.model = after->model;
      next = std::move(after);
    } catch (const NumericalFailure& failure) {
      ladder.stopped = "no equilibrium with " + added + ": " + failure.what();
      return ladder;
    }
    found = next.get();
    examined.model = with.model, examined.near = nullptr;
  }
  ladder.stopped = verdict_name(found->diagnosis.verdict) + ": " + found->diagnosis.why;
  return ladder;
}

}  // namespace supine::diagnosis
