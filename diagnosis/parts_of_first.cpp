// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/parts_of_first.h"

#include <algorithm>

#include "diagnosis/next_set.h"

namespace supine::diagnosis {

void follow_parts_of_first(FollowedSets& sets, std::vector<std::vector<int>>& looked_at) {
  constexpr double no_matter = 1;  // of ln evidence
  for (;;) {
    const std::vector<int> whole = sets.found.hypotheses.front().effects;
    if (whole.size() < 2 || std::find(looked_at.begin(), looked_at.end(), whole) != looked_at.end()) return;
    looked_at.push_back(whole);
    for (const int e : whole) {
      std::vector<int> part = whole;
      std::erase(part, e);
      const bool judged = sets.found.beside.empty() || is_part_of(sets.found.beside.back().effects, part);
      if (!judged || !sets.was_screened(part)) continue;
      if (sets.hypothesis_of(whole).ln_evidence - sets.hypothesis_of(part).ln_evidence > no_matter)
        sets.follow_within(whole, part);
    }
    sets.weigh();
    sets.settle_strengths();
  }
}

void follow_nothing_again(FollowedSets& sets) {
  constexpr double no_matter = 1, out_of_the_question = 0.01;  // of ln evidence; probability
  Hypothesis& nothing = sets.hypothesis_of({});
  if (nothing.probability < out_of_the_question) return;
  const Refit* best = nullptr;
  for (const Refit& refit : sets.found.refits) {
    const Hypothesis& h = refit.hypothesis;
    if (!refit.solved || h.effects.size() != 1 || h.ground != nothing.ground) continue;
    if (best == nullptr || h.ln_evidence > best->hypothesis.ln_evidence) best = &refit;
  }
  if (best == nullptr || best->hypothesis.ln_evidence - nothing.ln_evidence < no_matter) return;
  sets.tell("from an effect, nothing again: without", best->hypothesis.effects);
  const Refit again =
      refit_within(sets.subject.scene, sets.subject.given, sets.found.base, *best, sets.found.candidates, nothing);
  if (!again.solved || again.hypothesis.ln_evidence <= nothing.ln_evidence) return;
  nothing = again.hypothesis;
  sets.weigh();
}

}  // namespace supine::diagnosis
