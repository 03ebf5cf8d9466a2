// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/parts_of_first.h"

#include <algorithm>

#include "diagnosis/next_set.h"

namespace supine::diagnosis {
namespace {

constexpr double no_matter = 1;  // of ln evidence

/// Of refits of single effects under the errors of nothing the one for which @p worth is largest, where that is more
/// than no_matter above what nothing was found to be; or nullptr.
template <class Worth>
const Refit* best_single(const FollowedSets& sets, const Hypothesis& nothing, Worth worth) {
  const Refit* best = nullptr;
  double most = nothing.ln_evidence + no_matter;
  for (const Refit& refit : sets.found.refits) {
    const Hypothesis& h = refit.hypothesis;
    if (!refit.solved || h.effects.size() != 1 || h.ground != nothing.ground) continue;
    if (const double here = worth(refit); here > most) best = &refit, most = here;
  }
  return best;
}

const Refit* likelier_than_nothing(const FollowedSets& sets, const Hypothesis& nothing) {
  constexpr double out_of_the_question = 0.01;
  if (nothing.probability < out_of_the_question) return nullptr;
  return best_single(sets, nothing, [](const Refit& refit) { return refit.hypothesis.ln_evidence; });
}

const Refit* promising_nothing(const FollowedSets& sets, const Hypothesis& nothing) {
  return best_single(sets, nothing, [&sets](const Refit& refit) {
    const auto effect = static_cast<std::size_t>(refit.hypothesis.effects.front());
    return promised_without(refit, sets.found.candidates[effect]);
  });
}

}  // namespace

void follow_parts_of_first(FollowedSets& sets, std::vector<std::vector<int>>& looked_at) {
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
  Hypothesis& nothing = sets.hypothesis_of({});
  const Refit* from = likelier_than_nothing(sets, nothing);
  if (from == nullptr) from = promising_nothing(sets, nothing);
  if (from == nullptr || !sets.nothing_is_new_from(*from)) return;
  sets.tell("from an effect, nothing again: without", from->hypothesis.effects);
  const Refit again =
      refit_within(sets.subject.scene, sets.subject.given, sets.found.base, *from, sets.found.candidates, nothing);
  if (!again.solved || again.hypothesis.ln_evidence <= nothing.ln_evidence) return;
  nothing = again.hypothesis;
  sets.weigh();
}

}  // namespace supine::diagnosis
