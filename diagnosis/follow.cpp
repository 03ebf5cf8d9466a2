// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/follow.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/error.h"
#include "diagnosis/beside.h"
#include "diagnosis/evidence/left_out.h"
#include "diagnosis/evidence/strength_profile.h"
#include "diagnosis/next_set.h"

namespace supine::diagnosis {
namespace {

constexpr double worth_going_on = 0.1;  // the same of what holds more than a likeliest set that was followed
constexpr double stands_out = 0.05;     // inclusion from which more than two sets are followed
constexpr std::size_t refits_when_quiet = 2, most_simpler = 5;
constexpr double cost_of_an_idle_effect = 1;  // ln evidence, by and large
constexpr std::size_t singles_to_draw_from = 3, most_further = 8, most_where_lines_bend = 6;  // the last: times refits
constexpr std::size_t most_on_from_first = 5;

/// Effects that appear in what is screened with at least some probability.
bool something_stands_out(const Findings& found) {
  for (std::size_t e = 0; e < found.candidates.size(); ++e)
    if (inclusion(found.hypotheses, static_cast<int>(e)) > stands_out) return true;
  return false;
}

Hypothesis& hypothesis_of(Findings& found, const std::vector<int>& effects) {
  return *std::find_if(found.hypotheses.begin(), found.hypotheses.end(),
                       [&effects](const Hypothesis& h) { return h.effects == effects; });
}

class Follower {
 public:
  Follower(const Subject& subject, const ExamineOptions& options, Findings& found)
      : subject_(subject), options_(options), found_(found) {}

  void run() {
    if (options_.refits > 0) look_from_usual_sizes();
    if (options_.refits > 0) follow_expected();
    explore();
    if (settle_strengths()) {
      explore();
      settle_strengths();
    }
    if (options_.refits == 0) return;
    look_beside();
    if (!do_without_idle()) return;
    settle_strengths();
    look_beside();
  }

 private:
  void tell(const std::string& what, const std::vector<int>& effects) const {
    std::vector<std::string> names;
    for (const int e : effects) names.push_back(found_.candidates[static_cast<std::size_t>(e)].effect);
    if (options_.progress) options_.progress(fmt::format("{} {}", what, fmt::join(names, " and ")));
  }

  /// Whose errors a set is weighed under: those beside the most of it that they were measured beside.
  const BaseFit& ground_of(const std::vector<int>& effects) const {
    for (auto beside = found_.beside.rbegin(); beside != found_.beside.rend(); ++beside)
      if (is_part_of(beside->effects, effects)) return *beside->ground;
    return found_.base;
  }

  /// Where something is missing, lines from nothing do not show what a ligament would do. Of effects that this scan
  /// could not settle there is nothing to be seen.
  void look_from_usual_sizes() {
    if (!something_stands_out(found_)) return;
    if (options_.progress) options_.progress("lines from usual sizes");
    weigh_from_usual_size(subject_.scene, subject_.given, found_.base, found_.candidates, unsettled(found_.table),
                          found_.hypotheses);
  }

  bool first_holds_an_effect() const { return !found_.hypotheses.front().effects.empty(); }

  void weigh() {
    lower_unfollowed(found_.hypotheses);
    if (bent_) hold_to_parts();
    keep_odds(found_);
    normalise(found_.hypotheses);
  }

  /// What is screened as likely is followed, then what lines from there promise.
  void explore() {
    auto most = static_cast<std::size_t>(options_.refits);
    if (!something_stands_out(found_)) most = std::min(most, refits_when_quiet);
    for (std::size_t simpler = 0; !bent_ && !(first_holds_an_effect() && found_.hypotheses.front().refitted);) {
      const Hypothesis* next = found_.refits.size() < most ? next_to_refit(found_.hypotheses) : nullptr;
      if (next == nullptr && most > 0 && simpler < most_simpler)
        next = simpler_than_first(found_.hypotheses), ++simpler;
      if (next == nullptr) break;
      follow_one(next->effects);
    }
    if (!bent_ && most > 0) on_from_first();
    if (bent_) one_at_a_time();
  }

  /// Whether a strength of it is far from linear and its density was not asked for.
  bool is_unsettled(const Refit& refit) const {
    const auto& effects = refit.hypothesis.effects;
    return refit.solved && !refit.has_densities && std::any_of(effects.begin(), effects.end(), [this](int e) {
             return is_far_from_linear(found_.candidates[static_cast<std::size_t>(e)]);
           });
  }

  /// The likeliest refit whose strengths are not settled yet, of those that are likely; the number of refits where
  /// there is none.
  std::size_t next_to_settle() const {
    for (const Hypothesis& h : found_.hypotheses) {
      if (h.probability < worth_refitting) break;
      for (std::size_t r = 0; r < found_.refits.size(); ++r)
        if (is_unsettled(found_.refits[r]) && found_.refits[r].hypothesis.effects == h.effects) return r;
    }
    return found_.refits.size();
  }

  /// Strengths that are far from linear, of every set that is likely. @return  whether another set is the likeliest
  /// since
  bool settle_strengths() {
    const std::vector<int> first = found_.hypotheses.front().effects;
    for (std::size_t at = next_to_settle(); at < found_.refits.size(); at = next_to_settle()) {
      Refit& refit = found_.refits[at];
      tell("strengths of", refit.hypothesis.effects);
      const double gain = find_strength_densities(subject_.scene, found_.candidates, refit);
      hypothesis_of(found_, refit.hypothesis.effects).ln_evidence += gain;
      for (Hypothesis& h : found_.hypotheses)
        if (is_open(h) && h.drawn_at == static_cast<int>(at)) h.screened += gain, h.ln_evidence += gain;
      weigh();
    }
    return found_.hypotheses.front().effects != first;
  }

  void follow_one(const std::vector<int> effects) {
    tell("refit with", effects);
    Hypothesis& h = hypothesis_of(found_, effects);
    const JointFit& from = h.drawn_at < 0 ? found_.base : found_.refits[static_cast<std::size_t>(h.drawn_at)].joint;
    Refit refit = diagnosis::refit(subject_.scene, subject_.given, ground_of(effects), from, found_.candidates, h);
    if (refit.solved) {
      const double promised = h.screened;
      h = refit.hypothesis;
      bent_ = bent_ || promised - h.ln_evidence > lines_bend_at;
    } else {
      h.unsolved = true;
    }
    found_.refits.push_back(std::move(refit));
    weigh();
  }

  /// Along lines that do not hold a set is not believed to say more than its best part that was followed.
  void hold_to_parts() {
    for (Hypothesis& h : found_.hypotheses) {
      if (!is_open(h) || h.drawn_at >= 0 || h.effects.size() < 2) continue;
      double best = hypothesis_of(found_, {}).ln_evidence;
      for (const Hypothesis& part : found_.hypotheses)
        if (part.refitted && is_part_of(part.effects, h.effects)) best = std::max(best, part.ln_evidence);
      h.ln_evidence = std::min(h.ln_evidence, best);
    }
  }

  /// Lines from a refit to the set with each further effect, where none was drawn from a likelier part.
  void draw_from(std::size_t at) {
    const Refit& refit = found_.refits[at];
    const Hypothesis part = refit.hypothesis;
    tell("lines from", part.effects);
    std::vector<Candidate> further;
    try {
      calibration::Evaluator evaluator(subject_.scene, refit.joint.model, accurate_enough());
      std::vector<std::string> unfelt;
      further = find_candidates(evaluator, refit.joint.model, refit.joint.fit, unfelt);
      find_secants(subject_.scene, ground_of(part.effects), refit.joint, further);
    } catch (const NumericalFailure&) {
      return;  // a shape without slopes
    }
    const auto names = found_.effects();
    std::erase_if(further, [&names](const Candidate& c) {
      return std::find(names.begin(), names.end(), c.effect) == names.end();
    });
    for (Hypothesis& drawn : screen_beside(ground_of(part.effects), refit.joint, part, names, further, found_.priors)) {
      if (drawn.ground != &ground_of(drawn.effects)) continue;  // weighed under errors measured beside more
      drawn.drawn_at = static_cast<int>(at);
      const auto same = std::find_if(found_.hypotheses.begin(), found_.hypotheses.end(),
                                     [&drawn](const Hypothesis& h) { return h.effects == drawn.effects; });
      if (same == found_.hypotheses.end())
        found_.hypotheses.push_back(std::move(drawn));
      else if (is_open(*same) && (same->drawn_at < 0 || part.ln_evidence > evidence_at(same->drawn_at)))
        *same = std::move(drawn);
    }
    drawn_.push_back(at);
    weigh();
  }

  double evidence_at(int refit) const { return found_.refits[static_cast<std::size_t>(refit)].hypothesis.ln_evidence; }

  /// The refit of the likeliest hypothesis, where lines from it are of use and were not drawn yet; else the number of
  /// refits.
  std::size_t first_to_draw_from() const {
    const Hypothesis& first = found_.hypotheses.front();
    std::size_t at = 0;
    while (at < found_.refits.size() &&
           !(found_.refits[at].solved && found_.refits[at].hypothesis.effects == first.effects))
      ++at;
    const bool drawn = std::find(drawn_.begin(), drawn_.end(), at) != drawn_.end();
    return drawn || first.effects.size() + 1 >= found_.priors.of_sets.size() ? found_.refits.size() : at;
  }

  /// Sets of what was expected, of one effect, then of two.
  void follow_expected() {
    std::vector<int> expected;
    for (int e = 0; e < static_cast<int>(found_.candidates.size()); ++e)
      if (found_.priors.is_expected(found_.candidates[static_cast<std::size_t>(e)].effect)) expected.push_back(e);
    for (const int e : expected) follow_one({e});
    if (expected.size() < 2) return;
    for (std::size_t at = 0; at < expected.size(); ++at)
      if (found_.refits[at].solved) draw_from(at);
    for (std::size_t a = 0; a < expected.size(); ++a)
      for (std::size_t b = a + 1; b < expected.size(); ++b) follow_one({expected[a], expected[b]});
  }

  /// The refit of the likeliest hypothesis with one more effect that came out worse than without, or the number of
  /// refits: a set cannot fit worse than its part, so one that seems to ended elsewhere.
  std::size_t worse_than_first() const {
    const Hypothesis& first = found_.hypotheses.front();
    const auto found = std::find_if(found_.refits.begin(), found_.refits.end(), [&first](const Refit& refit) {
      const Hypothesis& h = refit.hypothesis;
      return refit.solved && h.effects.size() == first.effects.size() + 1 && is_part_of(first.effects, h.effects) &&
             h.ln_evidence < first.ln_evidence - cost_of_an_idle_effect;
    });
    return static_cast<std::size_t>(found - found_.refits.begin());
  }

  /// Such a set is followed once more, along lines from the likeliest; the likelier of both fits is kept.
  void again_from_first() {
    const std::size_t from = first_to_draw_from(), worse = worse_than_first();
    if (from >= found_.refits.size() || worse >= found_.refits.size()) return;
    const Hypothesis before = hypothesis_of(found_, found_.refits[worse].hypothesis.effects);
    hypothesis_of(found_, before.effects).refitted = false;
    draw_from(from);
    follow_one(before.effects);
    Hypothesis& after = hypothesis_of(found_, before.effects);
    if (after.refitted && after.ln_evidence > before.ln_evidence)
      std::swap(found_.refits[worse], found_.refits.back());
    else
      after = before;
    found_.refits.pop_back();
    weigh();
  }

  /// Lines from the likeliest, where none were drawn yet, and what they promise followed. @return  whether there was
  /// any
  bool one_step_on_from_first() {
    const std::size_t at = first_to_draw_from();
    if (at < found_.refits.size()) draw_from(at);
    const Hypothesis* next = next_to_refit(found_.hypotheses, worth_going_on);
    if (next == nullptr) next = simpler_than_first(found_.hypotheses);
    if (next == nullptr) return false;
    follow_one(next->effects);
    return true;
  }

  /// What stands out was followed; beside it other effects may do more than lines from nothing say: lines are drawn
  /// from it and what they promise is followed.
  void on_from_first() {
    for (std::size_t further = 0; further < most_on_from_first && !bent_ && first_holds_an_effect(); ++further)
      if (!one_step_on_from_first()) break;
    if (!bent_) again_from_first();
  }

  bool may_follow_more() const {
    return found_.refits.size() < most_where_lines_bend * static_cast<std::size_t>(options_.refits);
  }

  /// Every effect by itself, the likelier first.
  void follow_singles() {
    std::vector<int> singles;
    for (const Hypothesis& h : found_.hypotheses)
      if (is_open(h) && h.effects.size() == 1) singles.push_back(h.effects.front());
    for (const int effect : singles)
      if (may_follow_more()) follow_one({effect});
  }

  void one_at_a_time() {
    follow_singles();
    std::vector<std::size_t> singles;
    for (std::size_t r = 0; r < found_.refits.size(); ++r)
      if (found_.refits[r].solved && found_.refits[r].effects.size() == 1) singles.push_back(r);
    std::stable_sort(singles.begin(), singles.end(), [this](std::size_t a, std::size_t b) {
      return found_.refits[a].hypothesis.ln_evidence > found_.refits[b].hypothesis.ln_evidence;
    });
    if (singles.size() > singles_to_draw_from) singles.resize(singles_to_draw_from);
    for (const std::size_t at : singles)
      if (may_follow_more() && std::find(drawn_.begin(), drawn_.end(), at) == drawn_.end()) draw_from(at);
    for (std::size_t further = 0; further < most_further && may_follow_more(); ++further) {
      if (const std::size_t at = first_to_draw_from(); at < found_.refits.size()) draw_from(at);
      const Hypothesis* next = next_to_refit(found_.hypotheses);
      if (next == nullptr) next = simpler_than_first(found_.hypotheses);
      if (next == nullptr) return;
      follow_one(next->effects);
    }
  }

  std::vector<Refit>::iterator refit_of(const std::vector<int>& effects) const {
    return std::find_if(found_.refits.begin(), found_.refits.end(),
                        [&effects](const Refit& r) { return r.solved && r.hypothesis.effects == effects; });
  }

  /// The refit of a set, followed now where it was not; the number of refits where there is none.
  std::size_t refit_with(const std::vector<int>& effects) {
    auto at = refit_of(effects);
    const auto known = std::find_if(found_.hypotheses.begin(), found_.hypotheses.end(),
                                    [&effects](const Hypothesis& h) { return h.effects == effects; });
    if (at == found_.refits.end() && known != found_.hypotheses.end()) {
      follow_one(effects);
      at = refit_of(effects);
    }
    return static_cast<std::size_t>(at - found_.refits.begin());
  }

  /// Sets with more than @p part, followed again under the last errors where they were likely; the others are
  /// forgotten.
  void follow_again(const std::vector<int>& part) {
    const BaseFit& ground = *found_.beside.back().ground;
    for (Refit& refit : found_.refits) {
      const std::vector<int> effects = refit.hypothesis.effects;
      if (!refit.solved || !is_part_of(part, effects) || effects == part) continue;
      Hypothesis& h = hypothesis_of(found_, effects);
      if (h.probability >= worth_refitting) {
        tell("again with", effects);
        refit = refit_again(subject_.scene, ground, refit);
        h = refit.hypothesis;
      } else {
        refit.solved = false;
      }
    }
    std::erase_if(found_.hypotheses,
                  [&](const Hypothesis& h) { return is_part_of(part, h.effects) && h.ground != &ground; });
    std::erase_if(drawn_, [&](std::size_t at) { return is_part_of(part, found_.refits[at].hypothesis.effects); });
    weigh();
  }

  /// Errors of mesh and body measured beside a set, and all that holds it weighed under these. @return  whether they
  /// could be measured
  bool look_again_beside(const std::vector<int>& part) {
    const std::size_t at = refit_with(part);
    if (at >= found_.refits.size()) return false;
    tell("errors of mesh and body beside", part);
    Findings::Beside beside{part, nullptr, part.front(), ln_odds_of(found_.hypotheses, part), 0};
    if (!found_.beside.empty())
      for (const int e : part)
        if (!is_part_of({e}, found_.beside.back().effects)) beside.surest = e;
    beside.left_out_gain =
        left_out_gain_of(found_.hypotheses, beside.surest, left_out_parts(subject_.scene, found_.base));
    try {
      beside.ground = ground_beside(subject_.scene, found_.base, found_.refits[at].joint, found_.priors);
    } catch (const NumericalFailure&) {
      return false;  // those of the base fit have to do
    }
    Refit again = refit_again(subject_.scene, *beside.ground, found_.refits[at]);
    if (!again.solved) return false;  // nor can what holds it be weighed under these
    hypothesis_of(found_, part) = again.hypothesis;
    found_.refits[at] = std::move(again);
    found_.beside.push_back(std::move(beside));
    follow_again(part);
    draw_from(at);
    for (std::size_t further = 0; further < most_on_from_first; ++further)
      if (!one_step_on_from_first()) break;
    return true;
  }

  void look_beside() {
    for (std::vector<int> part = surest_part(found_); !part.empty(); part = surest_part(found_)) {
      if (!look_again_beside(part)) break;
      settle_strengths();
    }
  }

  /// An effect of the likeliest set that does nothing there, or -1.
  int idle_effect() const {
    const Hypothesis& first = found_.hypotheses.front();
    if (first.effects.size() < 2) return -1;
    const auto refit = refit_of(first.effects);
    if (refit == found_.refits.end()) return -1;
    for (const int e : first.effects)
      if (does_nothing(*refit, found_.candidates[static_cast<std::size_t>(e)])) return e;
    return -1;
  }

  /// Errors that were measured beside an effect count no more; what was weighed under them is weighed under those that
  /// are left.
  void drop_errors_beside(int effect) {
    const auto holds = [effect](const Findings::Beside& beside) { return is_part_of({effect}, beside.effects); };
    const auto from = std::find_if(found_.beside.begin(), found_.beside.end(), holds);
    std::move(from, found_.beside.end(), std::back_inserter(found_.dropped));
    found_.beside.erase(from, found_.beside.end());
    for (Refit& refit : found_.refits) {
      const std::vector<int> effects = refit.hypothesis.effects;
      const BaseFit& ground = ground_of(effects);
      if (!refit.solved || refit.hypothesis.ground == &ground) continue;
      refit = refit_again(subject_.scene, ground, refit);
      if (refit.solved) hypothesis_of(found_, effects) = refit.hypothesis;
    }
    std::erase_if(found_.hypotheses, [this](const Hypothesis& h) { return h.ground != &ground_of(h.effects); });
    std::erase_if(drawn_, [&](std::size_t at) { return is_part_of({effect}, found_.refits[at].hypothesis.effects); });
  }

  /// A part of a set is followed from where the whole ended; of two fits of it the likelier is kept.
  void follow_within(const std::vector<int>& whole, const std::vector<int>& part) {
    const auto h = std::find_if(found_.hypotheses.begin(), found_.hypotheses.end(),
                                [&part](const Hypothesis& one) { return one.effects == part; });
    const auto from = refit_of(whole), before = refit_of(part);
    if (from == found_.refits.end() || h == found_.hypotheses.end()) return;
    tell("without what does nothing, refit with", part);
    Refit refit = refit_within(subject_.scene, subject_.given, ground_of(part), *from, found_.candidates, *h);
    const bool first = before == found_.refits.end();
    if (!refit.solved || (!first && refit.hypothesis.ln_evidence <= h->ln_evidence)) return;
    *h = refit.hypothesis;
    if (first)
      found_.refits.push_back(std::move(refit));
    else
      *before = std::move(refit);
  }

  /// The likeliest set is followed without an effect of it that does nothing. @return  whether there was one
  bool do_without_idle() {
    const int idle = idle_effect();
    if (idle < 0) return false;
    const std::vector<int> whole = found_.hypotheses.front().effects;
    drop_errors_beside(idle);
    std::vector<int> part = whole;
    std::erase(part, idle);
    follow_within(whole, part);
    weigh();
    return true;
  }

  const Subject& subject_;
  const ExamineOptions& options_;
  Findings& found_;
  bool bent_ = false;
  std::vector<std::size_t> drawn_;  // refits
};

}  // namespace

void follow(const Subject& subject, const ExamineOptions& options, Findings& found) {
  Follower(subject, options, found).run();
  const auto rank = [&found](const Refit& refit) {
    for (const Hypothesis& h : found.hypotheses)
      if (refit.solved && h.effects == refit.hypothesis.effects) return h.probability;
    return -1.0;
  };
  std::stable_sort(found.refits.begin(), found.refits.end(),
                   [&rank](const Refit& a, const Refit& b) { return rank(a) > rank(b); });
}

}  // namespace supine::diagnosis
