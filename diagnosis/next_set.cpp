// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/next_set.h"

#include <algorithm>

namespace supine::diagnosis {

bool is_open(const Hypothesis& h) { return !h.effects.empty() && !h.refitted && !h.unsolved; }

const Hypothesis* next_to_refit(const std::vector<Hypothesis>& hypotheses, double least_with_first) {
  constexpr double held_by_refits = 0.99;  // of the screened probability
  double sum = 0;
  for (const Hypothesis& h : hypotheses) {
    const double least = is_part_of(hypotheses.front().effects, h.effects) ? least_with_first : worth_refitting;
    if (is_open(h) && h.probability >= least) return &h;
    sum += h.probability;
    if (sum >= held_by_refits) break;
  }
  return nullptr;
}

const Hypothesis* simpler_than_first(const std::vector<Hypothesis>& hypotheses) {
  const Hypothesis& first = hypotheses.front();
  if (!first.refitted || first.effects.size() < 2) return nullptr;
  const auto found = std::find_if(hypotheses.begin(), hypotheses.end(), [&first](const Hypothesis& h) {
    return is_open(h) && h.effects.size() + 1 == first.effects.size() && is_part_of(h.effects, first.effects);
  });
  return found == hypotheses.end() ? nullptr : &*found;
}

}  // namespace supine::diagnosis
