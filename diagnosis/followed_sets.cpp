// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/followed_sets.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "common/error.h"
#include "diagnosis/beside.h"
#include "diagnosis/evidence/strength_profile.h"
#include "diagnosis/next_set.h"

namespace supine::diagnosis {
namespace {

constexpr double worth_going_on = 0.1;  // probability of what holds more than a likeliest set that was followed

/// Whether a strength of it is far from linear and its density was not asked for.
bool is_unsettled(const Refit& refit, const std::vector<Candidate>& candidates) {
  const auto& effects = refit.hypothesis.effects;
  return refit.solved && !refit.has_densities && std::any_of(effects.begin(), effects.end(), [&candidates](int e) {
           return is_far_from_linear(candidates[static_cast<std::size_t>(e)]);
         });
}

}  // namespace

void FollowedSets::tell(const std::string& what, const std::vector<int>& effects) const {
  std::vector<std::string> names;
  for (const int e : effects) names.push_back(found.candidates[static_cast<std::size_t>(e)].effect);
  if (options.progress) options.progress(fmt::format("{} {}", what, fmt::join(names, " and ")));
}

const BaseFit& FollowedSets::ground_of(const std::vector<int>& effects) const {
  for (auto beside = found.beside.rbegin(); beside != found.beside.rend(); ++beside)
    if (is_part_of(beside->effects, effects)) return *beside->ground;
  return found.base;
}

bool FollowedSets::was_screened(const std::vector<int>& effects) const {
  return std::any_of(found.hypotheses.begin(), found.hypotheses.end(),
                     [&effects](const Hypothesis& h) { return h.effects == effects; });
}

Hypothesis& FollowedSets::hypothesis_of(const std::vector<int>& effects) const {
  return *std::find_if(found.hypotheses.begin(), found.hypotheses.end(),
                       [&effects](const Hypothesis& h) { return h.effects == effects; });
}

std::vector<Refit>::iterator FollowedSets::refit_of(const std::vector<int>& effects) const {
  return std::find_if(found.refits.begin(), found.refits.end(),
                      [&effects](const Refit& r) { return r.solved && r.hypothesis.effects == effects; });
}

std::size_t FollowedSets::refit_with(const std::vector<int>& effects) {
  if (refit_of(effects) == found.refits.end() && was_screened(effects)) follow_one(effects);
  return static_cast<std::size_t>(refit_of(effects) - found.refits.begin());
}

void FollowedSets::weigh() {
  lower_unfollowed(found.hypotheses);
  if (bent_) hold_to_parts();
  keep_odds(found);
  normalise(found.hypotheses);
}

/// Along lines that do not hold a set is not believed to say more than its best part that was followed.
void FollowedSets::hold_to_parts() {
  for (Hypothesis& h : found.hypotheses) {
    if (!is_open(h) || h.drawn_at >= 0 || h.effects.size() < 2) continue;
    double best = hypothesis_of({}).ln_evidence;
    for (const Hypothesis& part : found.hypotheses)
      if (part.refitted && is_part_of(part.effects, h.effects)) best = std::max(best, part.ln_evidence);
    h.ln_evidence = std::min(h.ln_evidence, best);
  }
}

void FollowedSets::follow_one(const std::vector<int> effects) {
  tell("refit with", effects);
  Hypothesis& h = hypothesis_of(effects);
  const JointFit& from = h.drawn_at < 0 ? found.base : found.refits[static_cast<std::size_t>(h.drawn_at)].joint;
  Refit refit = diagnosis::refit(subject.scene, subject.given, ground_of(effects), from, found.candidates, h);
  if (refit.solved) {
    const double promised = h.screened;
    h = refit.hypothesis;
    bent_ = bent_ || promised - h.ln_evidence > lines_bend_at;
  } else {
    h.unsolved = true;
  }
  found.refits.push_back(std::move(refit));
  weigh();
}

void FollowedSets::follow_within(const std::vector<int>& whole, const std::vector<int>& part) {
  const auto from = refit_of(whole), before = refit_of(part);
  if (from == found.refits.end() || !was_screened(part)) return;
  Hypothesis& h = hypothesis_of(part);
  tell("from a larger set, refit with", part);
  Refit refit = refit_within(subject.scene, subject.given, ground_of(part), *from, found.candidates, h);
  const bool first = before == found.refits.end();
  if (!refit.solved || (!first && refit.hypothesis.ln_evidence <= h.ln_evidence)) return;
  h = refit.hypothesis;
  if (first)
    found.refits.push_back(std::move(refit));
  else
    *before = std::move(refit);
}

/// The likeliest refit whose strengths are not settled yet, of those that are likely; the number of refits where
/// there is none.
std::size_t FollowedSets::next_to_settle() const {
  for (const Hypothesis& h : found.hypotheses) {
    if (h.probability < worth_refitting) break;
    for (std::size_t r = 0; r < found.refits.size(); ++r)
      if (is_unsettled(found.refits[r], found.candidates) && found.refits[r].hypothesis.effects == h.effects) return r;
  }
  return found.refits.size();
}

bool FollowedSets::settle_strengths() {
  const std::vector<int> first = found.hypotheses.front().effects;
  for (std::size_t at = next_to_settle(); at < found.refits.size(); at = next_to_settle()) {
    Refit& refit = found.refits[at];
    tell("strengths of", refit.hypothesis.effects);
    const double gain = find_strength_densities(subject.scene, found.candidates, refit);
    hypothesis_of(refit.hypothesis.effects).ln_evidence += gain;
    for (Hypothesis& h : found.hypotheses)
      if (is_open(h) && h.drawn_at == static_cast<int>(at)) h.screened += gain, h.ln_evidence += gain;
    weigh();
  }
  return found.hypotheses.front().effects != first;
}

void FollowedSets::draw_from(std::size_t at) {
  const Refit& refit = found.refits[at];
  const Hypothesis part = refit.hypothesis;
  tell("lines from", part.effects);
  std::vector<Candidate> further;
  try {
    calibration::Evaluator evaluator(subject.scene, refit.joint.model, accurate_enough());
    std::vector<std::string> unfelt;
    further = find_candidates(evaluator, refit.joint.model, refit.joint.fit, unfelt);
    find_secants(subject.scene, ground_of(part.effects), refit.joint, further);
  } catch (const NumericalFailure&) {
    return;  // a shape without slopes
  }
  const auto names = found.effects();
  std::erase_if(
      further, [&names](const Candidate& c) { return std::find(names.begin(), names.end(), c.effect) == names.end(); });
  for (Hypothesis& drawn : screen_beside(ground_of(part.effects), refit.joint, part, names, further, found.priors)) {
    if (drawn.ground != &ground_of(drawn.effects)) continue;  // weighed under errors measured beside more
    drawn.drawn_at = static_cast<int>(at);
    const auto same = std::find_if(found.hypotheses.begin(), found.hypotheses.end(),
                                   [&drawn](const Hypothesis& h) { return h.effects == drawn.effects; });
    if (same == found.hypotheses.end())
      found.hypotheses.push_back(std::move(drawn));
    else if (is_open(*same) && (same->drawn_at < 0 || part.ln_evidence > evidence_at(same->drawn_at)))
      *same = std::move(drawn);
  }
  drawn_.push_back(at);
  weigh();
}

double FollowedSets::evidence_at(int refit) const {
  return found.refits[static_cast<std::size_t>(refit)].hypothesis.ln_evidence;
}

std::size_t FollowedSets::first_to_draw_from() const {
  const Hypothesis& first = found.hypotheses.front();
  std::size_t at = 0;
  while (at < found.refits.size() && !(found.refits[at].solved && found.refits[at].hypothesis.effects == first.effects))
    ++at;
  return were_drawn_from(at) || first.effects.size() + 1 >= found.priors.of_sets.size() ? found.refits.size() : at;
}

bool FollowedSets::were_drawn_from(std::size_t refit) const {
  return std::find(drawn_.begin(), drawn_.end(), refit) != drawn_.end();
}

void FollowedSets::forget_lines_with(const std::vector<int>& part) {
  std::erase_if(drawn_, [&](std::size_t at) { return is_part_of(part, found.refits[at].hypothesis.effects); });
}

bool FollowedSets::one_step_on_from_first() {
  const std::size_t at = first_to_draw_from();
  if (at < found.refits.size()) draw_from(at);
  const Hypothesis* next = next_to_refit(found.hypotheses, worth_going_on);
  if (next == nullptr) next = simpler_than_first(found.hypotheses);
  if (next == nullptr) return false;
  follow_one(next->effects);
  return true;
}

bool FollowedSets::nothing_is_new_from(const Refit& refit) {
  const std::pair from{refit.hypothesis.effects, refit.joint.fit.u};
  if (std::find(nothing_from_.begin(), nothing_from_.end(), from) != nothing_from_.end()) return false;
  nothing_from_.push_back(from);
  return true;
}

}  // namespace supine::diagnosis
