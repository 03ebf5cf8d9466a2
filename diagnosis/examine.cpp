// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/examine.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "common/rms.h"
#include "common/statistics.h"
#include "diagnosis/evidence/left_out.h"
#include "diagnosis/evidence/local_fit.h"
#include "diagnosis/evidence/mesh_doubt.h"
#include "diagnosis/follow.h"
#include "diagnosis/stand_in.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

void tell(const ExamineOptions& options, const std::string& what) {
  if (options.progress) options.progress(what);
}

const Hypothesis& nothing_of(const Findings& found) {
  return *std::find_if(found.hypotheses.begin(), found.hypotheses.end(),
                       [](const Hypothesis& h) { return h.effects.empty(); });
}

/// What was left out, predicted by the likeliest hypothesis with an effect beside the same without it.
void ask_what_was_left_out(const Subject& subject, Findings& found) {
  std::vector<LeftOut> parts;
  const auto names = found.effects();
  for (Inclusion& one : found.included) {
    if (one.probability < found.priors.named_at) break;
    if (parts.empty()) parts = left_out_parts(subject.scene, found.base);
    const int effect = static_cast<int>(std::find(names.begin(), names.end(), one.effect) - names.begin());
    const auto before = std::find_if(found.beside.begin(), found.beside.end(),
                                     [effect](const Findings::Beside& b) { return b.surest == effect; });
    one.left_out_gain =
        before != found.beside.end() ? before->left_out_gain : left_out_gain_of(found.hypotheses, effect, parts);
  }
}

/// Of what would be named: whether a number of it ended at an end of its range, in the likeliest set that holds it.
void note_range_ends(Findings& found) {
  for (Inclusion& one : found.included) {
    if (one.probability < found.priors.named_at) break;
    const Refit* refit = found.likeliest_with(one.effect);
    if (refit == nullptr) continue;
    for (const FittedParameter& number : refit->parameters)
      if (number.name.starts_with(one.effect + ".") && number.end != RangeEnd::none) one.ends_at = number.name;
  }
}

Unexplained summary(std::vector<double> draws) {
  double sum = 0;
  for (const double draw : draws) sum += draw;
  return {sum / static_cast<double>(draws.size()), quantile(draws, 0.025), quantile(draws, 0.975)};
}

/// RMS of draws of the discrepancy over the fitted points of skin, in each of the likeliest hypotheses and over all.
void find_unexplained(unsigned seed, Findings& found) {
  constexpr int draws = 200;
  std::mt19937_64 generator(seed);
  const VectorXd members = (found.base.clusters.kind.array() == 0).select(found.base.clusters.members, 0.0);
  const auto draw = [&](const Hypothesis& h) {
    const VectorXd field = h.evidence->draw_discrepancy(h.rows, h.weighed, generator);
    return std::sqrt(field.cwiseAbs2().dot(members) / members.sum());
  };
  std::vector<double> weights;
  const auto of_one = [&](const Hypothesis& h) {
    std::vector<double> drawn;
    for (int k = 0; k < draws; ++k) drawn.push_back(draw(h));
    return summary(std::move(drawn));
  };
  for (const Hypothesis& h : found.hypotheses) {
    weights.push_back(h.probability);
    if (found.unexplained_by.size() < Findings::hypotheses_told) found.unexplained_by.push_back(of_one(h));
  }
  found.left_by_base = of_one(nothing_of(found));
  std::discrete_distribution<std::size_t> which(weights.begin(), weights.end());
  std::vector<double> all;
  for (int k = 0; k < 2 * draws; ++k) all.push_back(draw(found.hypotheses[which(generator)]));
  found.unexplained = summary(all);
}

/// One number of a scan's place by a hypothesis: its own nuisance and what an effect adds to it.
Known place_by(const Hypothesis& h, const std::string& pose, const std::string& number, bool mesh_errs) {
  const Directions& all = h.evidence->directions();
  VectorXd weights = VectorXd::Zero(static_cast<Index>(h.rows.size()));
  double stands = 0, believed = 0;
  for (const std::string& name : {pose + "/" + number, number}) {
    const int k = h.place_of(name);
    if (k < 0) continue;
    const int direction = h.rows[static_cast<std::size_t>(k)];
    weights[k] = all.unit[direction];
    stands += all.stands[direction];
    believed += std::pow(all.unit[direction] * all.sd[direction], 2);
  }
  const auto [offset, sd] = h.weighed.sum(weights);
  const Known known{stands + offset, sd};
  return mesh_errs && sd > 0 ? with_doubt(known, {0, std::sqrt(believed)}, mesh_doubt(number)) : known;
}

/// Where a scan lies, by the hypotheses as far as they are likely.
std::vector<ScanPlace> find_places(const Subject& subject, const Findings& found) {
  constexpr double worth_asking = 0.01;  // of the likeliest one's probability
  const simulation::Effect& place = simulation::place_of_scan();
  std::vector<ScanPlace> places;
  for (const auto* measurement : subject.scene.measurements) {
    ScanPlace at{measurement->pose.name, {}, {}, {}};
    for (int i = 0; i < 6; ++i) {
      const std::string number = simulation::parameter_name(place, place.parameters()[static_cast<std::size_t>(i)]);
      std::vector<std::pair<double, Known>> each;
      for (const Hypothesis& h : found.hypotheses)
        if (h.probability >= worth_asking * found.hypotheses.front().probability)
          each.emplace_back(h.probability, place_by(h, at.pose, number, found.base.numerical.has_value()));
      const Known known = mixed(each);
      const double unit = i < 3 ? 1 : 180 / std::numbers::pi;
      (i < 3 ? at.shift_mm : at.turn_deg)[i % 3] = unit * known.mean;
      at.sd[i] = unit * known.sd;
    }
    places.push_back(at);
  }
  return places;
}

/// Local causes along lines lose to effects that were followed; the likeliest are followed too.
void follow_local(const Subject& subject, const ExamineOptions& options, Findings& found) {
  tell(options, "local causes");
  const auto followed = follow_local_causes(subject.scene, subject.given, found.base, options.priors, found.hypotheses);
  if (!followed.empty()) found.unlisted = weigh_unlisted(found.base, options.priors, found.hypotheses, followed);
}

}  // namespace

const Inclusion& Findings::included_of(const std::string& effect) const {
  return *std::find_if(included.begin(), included.end(),
                       [&effect](const Inclusion& one) { return one.effect == effect; });
}

std::vector<std::pair<const Hypothesis*, Unexplained>> Findings::told() const {
  std::vector<std::pair<const Hypothesis*, Unexplained>> list;
  bool nothing = false;
  for (std::size_t h = 0; h < unexplained_by.size(); ++h) {
    list.emplace_back(&hypotheses[h], unexplained_by[h]);
    nothing = nothing || hypotheses[h].effects.empty();
  }
  if (!nothing) list.emplace_back(&nothing_of(*this), left_by_base);
  return list;
}

std::vector<std::string> Findings::effects() const {
  std::vector<std::string> names;
  for (const Candidate& candidate : candidates) names.push_back(candidate.effect);
  return names;
}

std::vector<std::string> Findings::errors_beside() const {
  std::vector<std::string> names;
  if (!beside.empty())
    for (const int effect : beside.back().effects) names.push_back(candidates[static_cast<std::size_t>(effect)].effect);
  return names;
}

const Refit* Findings::refit_of(const std::vector<std::string>& wanted) const {
  const std::set<std::string> set(wanted.begin(), wanted.end());
  for (const Refit& refit : refits)
    if (refit.solved && std::set<std::string>(refit.effects.begin(), refit.effects.end()) == set) return &refit;
  return nullptr;
}

const Refit* Findings::likeliest_with(const std::string& effect) const {
  const auto names = effects();
  for (const Hypothesis& h : hypotheses) {
    std::vector<std::string> set;
    for (const int e : h.effects) set.push_back(names[static_cast<std::size_t>(e)]);
    if (std::find(set.begin(), set.end(), effect) == set.end()) continue;
    if (const Refit* refit = refit_of(set)) return refit;
  }
  return nullptr;
}

std::unique_ptr<Findings> examine(const Subject& subject, const ExamineOptions& options) {
  auto found = std::make_unique<Findings>();
  found->priors = options.priors;
  calibration::Evaluator evaluator(subject.scene, subject.start, accurate_enough());
  found->base = fit_base_model(evaluator, subject.given, subject.start, subject.noise_mm, subject.near,
                               {options.priors, options.other_meshes, options.progress});
  const calibration::Fit& fit = found->base.fit;
  found->rms_mm = rms(fit.residuals.skin_mm());
  tell(options, "catalogue");
  found->errors.emplace(found->base, found->base.nuisances, found->base.size_mm);
  found->candidates = find_candidates(evaluator, found->base.model, fit, found->unseen);
  tell(options, "effects at their usual size");
  find_secants(subject.scene, found->base, found->base, found->candidates, true);
  find_stand_ins(subject.scene, found->base, *found->errors, options.priors, found->candidates);
  found->table = score_candidates(fit.residuals, found->errors->metric().mean_mm, fit.linearisation.slope,
                                  found->candidates, found->errors->whitening(), options.seed);
  tell(options, "evidence");
  found->hypotheses = Screening(found->base, found->candidates, options.priors).hypotheses();
  found->held_out_rms_mm = held_out_rms(found->base, nothing_of(*found), fit.residuals);
  follow(subject, options, *found);
  found->unlisted = weigh_unlisted(found->base, options.priors, found->hypotheses);
  if (options.refits > 0) follow_local(subject, options, *found);
  found->included = inclusions(found->hypotheses, found->effects(), options.priors);
  ask_what_was_left_out(subject, *found);
  note_range_ends(*found);
  find_unexplained(options.seed, *found);
  found->places = find_places(subject, *found);
  found->budget = error_budget(*found);
  found->diagnosis = decide(found->hypotheses, found->effects(), found->included, found->unexplained, options.priors,
                            unsettled(found->table));
  found->under_other_priors = under_other_priors(found->hypotheses, found->effects(), found->included,
                                                 found->unexplained, options.priors, unsettled(found->table));
  if (found->diagnosis.verdict == Verdict::unexplained) {
    tell(options, "map of missing forces");
    const FitErrors known(found->base, found->base.nuisances, 0);
    found->forces = force_map(subject.scene, found->base.model, fit, known.metric(), options.seed);
  }
  return found;
}

}  // namespace supine::diagnosis
