// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/follow.h"

#include <algorithm>
#include <map>
#include <string>

#include "diagnosis/followed_sets.h"
#include "diagnosis/look_beside.h"
#include "diagnosis/next_set.h"
#include "diagnosis/parts_of_first.h"

namespace supine::diagnosis {
namespace {

constexpr double stands_out = 0.05;   // inclusion from which more than two sets are followed
constexpr double rare_place = 22.46;  // of six squares of standard normal numbers the sum, one in a thousand times
constexpr std::size_t refits_when_quiet = 2, most_simpler = 5;
constexpr double cost_of_an_idle_effect = 1;  // ln evidence, by and large
constexpr std::size_t singles_to_draw_from = 3, most_further = 8, most_where_lines_bend = 6;  // the last: times refits

/// Effects that appear in what is screened with at least some probability.
bool something_stands_out(const Findings& found) {
  for (std::size_t e = 0; e < found.candidates.size(); ++e)
    if (inclusion(found.hypotheses, static_cast<int>(e)) > stands_out) return true;
  return false;
}

/// Where something is missing, lines from nothing do not show what a ligament would do. Of effects that this scan
/// could not settle there is nothing to be seen.
void look_from_usual_sizes(FollowedSets& sets) {
  if (!something_stands_out(sets.found)) return;
  if (sets.options.progress) sets.options.progress("lines from usual sizes");
  weigh_from_usual_size(sets.subject.scene, sets.subject.given, sets.found.base, sets.found.candidates,
                        unsettled(sets.found.table), sets.found.hypotheses);
}

/// The effect that moves scans, where one of them lies where one in a thousand would by what is believed of places;
/// empty where none does.
std::string mover_of_misplaced(const BaseFit& base) {
  std::map<std::string, double> squares;
  for (const Nuisance& nuisance : base.nuisances) {
    if (nuisance.source != "registration") continue;
    squares[nuisance.pose] += nuisance.value * nuisance.value;
    if (squares[nuisance.pose] > rare_place) return nuisance.effect;
  }
  return {};
}

/// Closest points of a scan that lies far off are others where it belongs: lines from a fit that believes it nearer
/// show what is not there, and it is found first. @return  whether that is the likeliest since
bool follow_misplaced(FollowedSets& sets) {
  const auto names = sets.found.effects();
  const auto place = std::find(names.begin(), names.end(), mover_of_misplaced(sets.found.base));
  if (place == names.end()) return false;
  sets.follow_one({static_cast<int>(place - names.begin())});
  return sets.first_holds_an_effect() && sets.found.hypotheses.front().refitted;
}

/// Sets of what was expected, of one effect, then of two.
void follow_expected(FollowedSets& sets) {
  std::vector<int> expected;
  for (int e = 0; e < static_cast<int>(sets.found.candidates.size()); ++e)
    if (sets.found.priors.is_expected(sets.found.candidates[static_cast<std::size_t>(e)].effect)) expected.push_back(e);
  std::vector<std::size_t> followed;
  for (const int e : expected) followed.push_back(sets.refit_with({e}));
  if (expected.size() < 2) return;
  for (const std::size_t at : followed)
    if (at < sets.found.refits.size()) sets.draw_from(at);
  for (std::size_t a = 0; a < expected.size(); ++a)
    for (std::size_t b = a + 1; b < expected.size(); ++b) sets.follow_one({expected[a], expected[b]});
}

/// The refit of the likeliest hypothesis with one more effect that came out worse than without, or the number of
/// refits: a set cannot fit worse than its part, so one that seems to ended elsewhere.
std::size_t worse_than_first(const FollowedSets& sets) {
  const Hypothesis& first = sets.found.hypotheses.front();
  const auto found = std::find_if(sets.found.refits.begin(), sets.found.refits.end(), [&first](const Refit& refit) {
    const Hypothesis& h = refit.hypothesis;
    return refit.solved && h.effects.size() == first.effects.size() + 1 && is_part_of(first.effects, h.effects) &&
           h.ln_evidence < first.ln_evidence - cost_of_an_idle_effect;
  });
  return static_cast<std::size_t>(found - sets.found.refits.begin());
}

/// Such a set is followed once more, along lines from the likeliest; the likelier of both fits is kept.
void again_from_first(FollowedSets& sets) {
  const std::size_t from = sets.first_to_draw_from(), worse = worse_than_first(sets);
  if (from >= sets.found.refits.size() || worse >= sets.found.refits.size()) return;
  const Hypothesis before = sets.hypothesis_of(sets.found.refits[worse].hypothesis.effects);
  sets.hypothesis_of(before.effects).refitted = false;
  sets.draw_from(from);
  sets.follow_one(before.effects);
  Hypothesis& after = sets.hypothesis_of(before.effects);
  if (after.refitted && after.ln_evidence > before.ln_evidence)
    std::swap(sets.found.refits[worse], sets.found.refits.back());
  else
    after = before;
  sets.found.refits.pop_back();
  sets.weigh();
}

/// What stands out was followed; beside it other effects may do more than lines from nothing say: lines are drawn
/// from it and what they promise is followed.
void on_from_first(FollowedSets& sets) {
  for (std::size_t further = 0; further < most_on_from_first && !sets.lines_bend() && sets.first_holds_an_effect();
       ++further)
    if (!sets.one_step_on_from_first()) break;
  if (!sets.lines_bend()) again_from_first(sets);
}

bool may_follow_more(const FollowedSets& sets) {
  return sets.found.refits.size() < most_where_lines_bend * static_cast<std::size_t>(sets.options.refits);
}

/// Every effect by itself, the likelier first.
void follow_singles(FollowedSets& sets) {
  std::vector<int> singles;
  for (const Hypothesis& h : sets.found.hypotheses)
    if (is_open(h) && h.effects.size() == 1) singles.push_back(h.effects.front());
  for (const int effect : singles)
    if (may_follow_more(sets)) sets.follow_one({effect});
}

void one_at_a_time(FollowedSets& sets) {
  follow_singles(sets);
  std::vector<std::size_t> singles;
  for (std::size_t r = 0; r < sets.found.refits.size(); ++r)
    if (sets.found.refits[r].solved && sets.found.refits[r].effects.size() == 1) singles.push_back(r);
  std::stable_sort(singles.begin(), singles.end(), [&sets](std::size_t a, std::size_t b) {
    return sets.found.refits[a].hypothesis.ln_evidence > sets.found.refits[b].hypothesis.ln_evidence;
  });
  if (singles.size() > singles_to_draw_from) singles.resize(singles_to_draw_from);
  for (const std::size_t at : singles)
    if (may_follow_more(sets) && !sets.were_drawn_from(at)) sets.draw_from(at);
  for (std::size_t further = 0; further < most_further && may_follow_more(sets); ++further) {
    if (const std::size_t at = sets.first_to_draw_from(); at < sets.found.refits.size()) sets.draw_from(at);
    const Hypothesis* next = next_to_refit(sets.found.hypotheses);
    if (next == nullptr) next = simpler_than_first(sets.found.hypotheses);
    if (next == nullptr) return;
    sets.follow_one(next->effects);
  }
}

/// What is screened as likely is followed, then what lines from there promise.
void explore(FollowedSets& sets) {
  auto most = static_cast<std::size_t>(sets.options.refits);
  if (!something_stands_out(sets.found)) most = std::min(most, refits_when_quiet);
  for (std::size_t simpler = 0;
       !sets.lines_bend() && !(sets.first_holds_an_effect() && sets.found.hypotheses.front().refitted);) {
    const Hypothesis* next = sets.found.refits.size() < most ? next_to_refit(sets.found.hypotheses) : nullptr;
    if (next == nullptr && most > 0 && simpler < most_simpler)
      next = simpler_than_first(sets.found.hypotheses), ++simpler;
    if (next == nullptr) break;
    sets.follow_one(next->effects);
  }
  if (!sets.lines_bend() && most > 0) on_from_first(sets);
  if (sets.lines_bend()) one_at_a_time(sets);
}

}  // namespace

void follow(const Subject& subject, const ExamineOptions& options, Findings& found) {
  FollowedSets sets(subject, options, found);
  if (options.refits > 0 && !follow_misplaced(sets)) look_from_usual_sizes(sets);
  if (options.refits > 0) follow_expected(sets);
  explore(sets);
  if (sets.settle_strengths()) {
    explore(sets);
    sets.settle_strengths();
  }
  if (options.refits > 0) {
    std::vector<std::vector<int>> looked_at;
    follow_parts_of_first(sets, looked_at);
    follow_nothing_again(sets);
    look_beside(sets);
    if (do_without_idle(sets)) {
      sets.settle_strengths();
      look_beside(sets);
    }
    follow_parts_of_first(sets, looked_at);
    follow_nothing_again(sets);
  }
  const auto rank = [&found](const Refit& refit) {
    for (const Hypothesis& h : found.hypotheses)
      if (refit.solved && h.effects == refit.hypothesis.effects) return h.probability;
    return -1.0;
  };
  std::stable_sort(found.refits.begin(), found.refits.end(),
                   [&rank](const Refit& a, const Refit& b) { return rank(a) > rank(b); });
}

}  // namespace supine::diagnosis
