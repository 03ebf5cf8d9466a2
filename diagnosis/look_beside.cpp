// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/look_beside.h"

#include <algorithm>
#include <iterator>

#include "common/error.h"
#include "diagnosis/beside.h"
#include "diagnosis/evidence/left_out.h"
#include "diagnosis/next_set.h"

namespace supine::diagnosis {
namespace {

/// Sets with more than @p part, followed again under the last errors where they were likely; the others are
/// forgotten.
void follow_again(FollowedSets& sets, const std::vector<int>& part) {
  const BaseFit& ground = *sets.found.beside.back().ground;
  for (Refit& refit : sets.found.refits) {
    const std::vector<int> effects = refit.hypothesis.effects;
    if (!refit.solved || !is_part_of(part, effects) || effects == part) continue;
    Hypothesis& h = sets.hypothesis_of(effects);
    if (h.probability >= worth_refitting) {
      sets.tell("again with", effects);
      refit = refit_again(sets.subject.scene, ground, refit);
      h = refit.hypothesis;
    } else {
      refit.solved = false;
    }
  }
  std::erase_if(sets.found.hypotheses,
                [&](const Hypothesis& h) { return is_part_of(part, h.effects) && h.ground != &ground; });
  sets.forget_lines_with(part);
  sets.weigh();
}

/// By how much ln of the evidence of a set leads the same without an effect, less under errors measured beside the set
/// than under those before, both fitted under each; 0 where it leads no less. An effect that the errors beside it make
/// light of was named for what the errors before were too small for.
/// @param before, again  the set, by Laplace's formula, under the errors before and those beside it
double lead_lost(const FollowedSets& sets, const Hypothesis& before, const Refit& again, const BaseFit& ground,
                 int effect) {
  std::vector<int> rest = before.effects;
  std::erase(rest, effect);
  if (!sets.was_screened(rest) || !(rest.empty() || sets.hypothesis_of(rest).refitted)) return 0;
  const Hypothesis& without = sets.hypothesis_of(rest);
  const Refit then =
      refit_within(sets.subject.scene, sets.subject.given, ground, again, sets.found.candidates, without);
  if (!then.solved) return 0;  // it cannot do without
  const double lead = before.weighed.ln_evidence - without.weighed.ln_evidence;
  return std::max(0.0, lead - (again.hypothesis.ln_evidence - then.hypothesis.ln_evidence));
}

/// Errors of mesh and body measured beside a set, and all that holds it weighed under these. @return  whether they
/// could be measured
bool look_again_beside(FollowedSets& sets, const std::vector<int>& part) {
  const std::size_t at = sets.refit_with(part);
  if (at >= sets.found.refits.size()) return false;
  sets.tell("errors of mesh and body beside", part);
  Findings::Beside beside{part, nullptr, part.front(), ln_odds_of(sets.found.hypotheses, part), 0};
  if (!sets.found.beside.empty())
    for (const int e : part)
      if (!is_part_of({e}, sets.found.beside.back().effects)) beside.surest = e;
  beside.left_out_gain =
      left_out_gain_of(sets.found.hypotheses, beside.surest, left_out_parts(sets.subject.scene, sets.found.base));
  try {
    beside.ground = ground_beside(sets.subject.scene, sets.found.base, sets.found.refits[at].joint, sets.found.priors);
  } catch (const NumericalFailure&) {
    return false;  // those of the base fit have to do
  }
  Refit again = refit_again(sets.subject.scene, *beside.ground, sets.found.refits[at]);
  if (!again.solved) return false;  // nor can what holds it be weighed under these
  beside.ln_odds -= lead_lost(sets, sets.hypothesis_of(part), again, *beside.ground, beside.surest);
  sets.hypothesis_of(part) = again.hypothesis;
  sets.found.refits[at] = std::move(again);
  sets.found.beside.push_back(std::move(beside));
  follow_again(sets, part);
  sets.draw_from(at);
  for (std::size_t further = 0; further < most_on_from_first; ++further)
    if (!sets.one_step_on_from_first()) break;
  return true;
}

/// An effect of the likeliest set that does nothing there, or -1.
int idle_effect(const FollowedSets& sets) {
  const Hypothesis& first = sets.found.hypotheses.front();
  if (first.effects.size() < 2) return -1;
  const auto refit = sets.refit_of(first.effects);
  if (refit == sets.found.refits.end()) return -1;
  for (const int e : first.effects)
    if (does_nothing(*refit, sets.found.candidates[static_cast<std::size_t>(e)])) return e;
  return -1;
}

/// Errors that were measured beside an effect count no more; what was weighed under them is weighed under those that
/// are left.
void drop_errors_beside(FollowedSets& sets, int effect) {
  const auto holds = [effect](const Findings::Beside& beside) { return is_part_of({effect}, beside.effects); };
  const auto from = std::find_if(sets.found.beside.begin(), sets.found.beside.end(), holds);
  std::move(from, sets.found.beside.end(), std::back_inserter(sets.found.dropped));
  sets.found.beside.erase(from, sets.found.beside.end());
  for (Refit& refit : sets.found.refits) {
    const std::vector<int> effects = refit.hypothesis.effects;
    const BaseFit& ground = sets.ground_of(effects);
    if (!refit.solved || refit.hypothesis.ground == &ground) continue;
    refit = refit_again(sets.subject.scene, ground, refit);
    if (refit.solved) sets.hypothesis_of(effects) = refit.hypothesis;
  }
  std::erase_if(sets.found.hypotheses, [&sets](const Hypothesis& h) { return h.ground != &sets.ground_of(h.effects); });
  sets.forget_lines_with({effect});
}

}  // namespace

void look_beside(FollowedSets& sets) {
  for (std::vector<int> part = surest_part(sets.found); !part.empty(); part = surest_part(sets.found)) {
    if (!look_again_beside(sets, part)) break;
    sets.settle_strengths();
  }
}

bool do_without_idle(FollowedSets& sets) {
  const int idle = idle_effect(sets);
  if (idle < 0) return false;
  const std::vector<int> whole = sets.found.hypotheses.front().effects;
  drop_errors_beside(sets, idle);
  std::vector<int> part = whole;
  std::erase(part, idle);
  sets.follow_within(whole, part);
  sets.weigh();
  return true;
}

}  // namespace supine::diagnosis
