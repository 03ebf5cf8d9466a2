// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/hypotheses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "calibration/work_limit.h"
#include "common/error.h"
#include "common/first_failure.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

constexpr std::size_t pairs_for_triples = 10;
constexpr double least_rest = 0.3;  // of the usual size: a shorter secant is no better than the slope

/// Rows of the nuisances that an effect replaces: those of its own kind that are one for all poses.
std::vector<int> replaced_by(const JointFit& at, const std::string& effect) {
  std::vector<int> rows;
  const auto moduli = static_cast<int>(at.fit.u.size());
  for (std::size_t k = 0; k < at.nuisances.size(); ++k)
    if (at.nuisances[k].effect == effect && at.nuisances[k].pose.empty()) rows.push_back(moduli + static_cast<int>(k));
  return rows;
}

/// What these say, in the effect's own unit.
double already_said(const JointFit& at, const std::string& effect) {
  double already = 0;
  for (const int row : replaced_by(at, effect)) {
    const Nuisance& nuisance = at.nuisances[static_cast<std::size_t>(row - at.fit.u.size())];
    already += nuisance.value * nuisance.sigma;
  }
  return already;
}

/// Adds the numbers of a candidate to the directions, and gives their rows.
std::vector<int> add_candidate(const BaseFit& base, const JointFit& at, const Candidate& candidate, Directions& all) {
  std::vector<int> rows;
  const double already = already_said(at, candidate.effect);
  const Eigen::MatrixXd slope = base.clusters.means(candidate.slope);
  for (std::size_t k = 0; k < candidate.parameters.size(); ++k) {
    const CandidateParameter& p = candidate.parameters[k];
    const StrengthPrior prior = strength_prior(*simulation::find_parameter(p.name));
    Eigen::VectorXd column = slope.col(static_cast<Eigen::Index>(k));
    if (candidate.secant.size() > 0) column = base.clusters.means(candidate.secant) / (prior.median - p.null);
    rows.push_back(static_cast<int>(all.size()));
    all.add(p.name, column, prior.mean() - p.null - already, prior.sd());
    if (prior.log_normal) all.cut_below(-already);
  }
  return rows;
}

/// @p rows without those that are replaced, and with those of an effect.
std::vector<int> exchanged(std::vector<int> rows, const std::vector<int>& replaced, const std::vector<int>& own) {
  std::erase_if(rows, [&](int row) { return std::find(replaced.begin(), replaced.end(), row) != replaced.end(); });
  rows.insert(rows.end(), own.begin(), own.end());
  return rows;
}

}  // namespace

bool is_part_of(const std::vector<int>& part, const std::vector<int>& whole) {
  return std::includes(whole.begin(), whole.end(), part.begin(), part.end());
}

int Hypothesis::place_of(const std::string& name) const {
  const auto& names = evidence->directions().names;
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (names[static_cast<std::size_t>(rows[k])] == name) return static_cast<int>(k);
  return -1;
}

void lower_unfollowed(std::vector<Hypothesis>& hypotheses) {
  constexpr double none = std::numeric_limits<double>::infinity();
  double least[2] = {none, none};             // from the base fit, from refits
  std::map<const BaseFit*, double> simplest;  // evidence of the smallest set that was followed under each ground
  std::map<const BaseFit*, std::size_t> size;
  for (const Hypothesis& h : hypotheses) {
    double& own = least[h.drawn_at < 0 ? 0 : 1];
    if (h.refitted && !h.again) own = std::min(own, h.screened - h.ln_evidence);
    if (!h.effects.empty() && !h.refitted) continue;
    const auto at = size.try_emplace(h.ground, h.effects.size()).first;
    if (h.effects.size() <= at->second) at->second = h.effects.size(), simplest[h.ground] = h.ln_evidence;
  }
  for (Hypothesis& h : hypotheses) {
    const double own = least[h.drawn_at < 0 ? 0 : 1];
    if (h.refitted || h.effects.empty() || !std::isfinite(own)) continue;
    double fall = std::max(own, 0.0);
    for (const Hypothesis& part : hypotheses)
      if (h.drawn_at < 0 && part.drawn_at < 0 && part.refitted && !part.again && is_part_of(part.effects, h.effects))
        fall = std::max(fall, part.screened - part.ln_evidence);
    const auto floor = simplest.find(h.ground);
    h.ln_evidence = std::max(h.screened - fall, floor == simplest.end() ? -none : std::min(h.screened, floor->second));
  }
}

double ln_weight(const Hypothesis& h) {
  return h.ln_prior + h.ln_evidence + h.ln_unlisted + (h.ground != nullptr ? h.ground->ln_weight : 0);
}

void normalise(std::vector<Hypothesis>& hypotheses) {
  double most = -1e300, sum = 0;
  for (const Hypothesis& h : hypotheses) most = std::max(most, ln_weight(h));
  for (Hypothesis& h : hypotheses) sum += h.probability = std::exp(ln_weight(h) - most);
  for (Hypothesis& h : hypotheses) h.probability /= sum;
  std::stable_sort(hypotheses.begin(), hypotheses.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.probability > b.probability; });
}

double inclusion(const std::vector<Hypothesis>& hypotheses, int effect) {
  double sum = 0;
  for (const Hypothesis& h : hypotheses)
    if (std::find(h.effects.begin(), h.effects.end(), effect) != h.effects.end()) sum += h.probability;
  return sum;
}

Screening::Screening(const BaseFit& base, const std::vector<Candidate>& candidates, const Priors& priors)
    : priors_(priors), base_(base) {
  Directions all = directions_at(base.fit, *base.parameters, base.nuisances, base.clusters);
  base_rows_ = first_rows(all.size());
  for (const Candidate& candidate : candidates) {
    effects_.push_back(candidate.effect);
    replaced_.push_back(replaced_by(base, candidate.effect));
    of_effect_.push_back(add_candidate(base, base, candidate, all));
  }
  evidence_ = std::make_shared<LinearEvidence>(*base.covariance, base.distances(base.fit.residuals), std::move(all));
  const int count = static_cast<int>(effects_.size());
  hypotheses_.push_back(weigh({}));
  for (int a = 0; a < count; ++a) hypotheses_.push_back(weigh({a}));
  std::vector<Hypothesis> pairs;
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b) pairs.push_back(weigh({a, b}));
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.ln_evidence > b.ln_evidence; });
  std::set<std::vector<int>> triples;
  for (std::size_t p = 0; p < std::min(pairs_for_triples, pairs.size()); ++p)
    for (int c = 0; c < count; ++c) {
      std::vector<int> three = pairs[p].effects;
      if (std::find(three.begin(), three.end(), c) != three.end()) continue;
      three.push_back(c);
      std::sort(three.begin(), three.end());
      triples.insert(three);
    }
  hypotheses_.insert(hypotheses_.end(), pairs.begin(), pairs.end());
  for (const auto& three : triples) hypotheses_.push_back(weigh(three));
  normalise(hypotheses_);
}

Hypothesis Screening::weigh(std::vector<int> effects) const {
  Hypothesis h;
  h.ln_prior = priors_.ln_of_set(effects_, effects);
  h.rows = base_rows_;
  for (const int effect : effects) {
    const auto e = static_cast<std::size_t>(effect);
    h.rows = exchanged(std::move(h.rows), replaced_[e], of_effect_[e]);
  }
  h.effects = std::move(effects);
  h.evidence = evidence_;
  h.ground = &base_;
  h.weighed = evidence_->weigh(h.rows);
  h.ln_evidence = h.screened = h.weighed.ln_evidence;
  return h;
}

std::vector<Hypothesis> screen_beside(const BaseFit& ground, const JointFit& at, const Hypothesis& part,
                                      const std::vector<std::string>& effects, const std::vector<Candidate>& further,
                                      const Priors& priors) {
  Directions all = directions_at(at.fit, *at.parameters, at.nuisances, ground.clusters);
  const std::vector<int> own = first_rows(all.size());
  std::vector<std::vector<int>> rows;
  for (const Candidate& candidate : further) rows.push_back(add_candidate(ground, at, candidate, all));
  const auto evidence =
      std::make_shared<LinearEvidence>(*ground.covariance, ground.distances(at.fit.residuals), std::move(all));
  std::vector<Hypothesis> list;
  for (std::size_t c = 0; c < further.size(); ++c) {
    Hypothesis h;
    h.effects = part.effects;
    h.effects.push_back(
        static_cast<int>(std::find(effects.begin(), effects.end(), further[c].effect) - effects.begin()));
    std::sort(h.effects.begin(), h.effects.end());
    h.ln_prior = priors.ln_of_set(effects, h.effects);
    h.rows = exchanged(own, replaced_by(at, further[c].effect), rows[c]);
    h.evidence = evidence;
    h.ground = &ground;
    h.weighed = evidence->weigh(h.rows);
    // Where the part's strength is far from linear its evidence is another one than Laplace's.
    h.ln_evidence = h.screened = h.weighed.ln_evidence + part.ln_evidence - part.weighed.ln_evidence;
    if (std::isfinite(h.ln_evidence)) list.push_back(std::move(h));  // else its slopes there are no numbers
  }
  return list;
}

void find_secants(const calibration::MeasuredScene& scene, const BaseFit& base, const JointFit& at,
                  std::vector<Candidate>& candidates, bool keep_shapes) {
  const int dearest = std::max(base.dearest, at.dearest);
  const auto find_secant = [&](std::size_t c) {
    const auto& rows = candidates[c].parameters;
    const simulation::Parameter* row = simulation::find_parameter(rows[0].name);
    if (rows.size() != 1 || row->median == row->null) return;
    simulation::Model model = at.model;
    model.effects.push_back(simulation::null_setting(*simulation::find_effect(candidates[c].effect)));
    const double usual = row->median - row->null, rest = usual - already_said(at, candidates[c].effect);
    if (std::abs(rest) < least_rest * std::abs(usual)) return;
    model.effects.back().parameters[row->name].value = row->null + rest;
    try {
      calibration::Evaluator evaluator(scene, model, accurate_enough_far_away());
      const calibration::TrialLimit limit(evaluator.chain(), dearest);
      simulation::ChainSolution near = at.fit.prediction.solution;
      move_along(candidates[c], 0, rest, near);
      calibration::Prediction moved = evaluator.predict(model, &near);
      const auto there = calibration::residuals_of(scene, moved, at.fit.mask, base.noise_mm);
      candidates[c].secant = (usual / rest) * (there.distance_mm - at.fit.residuals.distance_mm);
      candidates[c].secant_to = rest;
      if (keep_shapes)
        candidates[c].secant_at = std::make_shared<const simulation::ChainSolution>(std::move(moved.solution));
    } catch (const NumericalFailure&) {
      // No equilibrium at the usual size, or none that costs as little: the slope at the null has to do.
      candidates[c].no_secant = true;
    }
  };
  FirstFailure failure;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t c = 0; c < candidates.size(); ++c) failure.guard([&] { find_secant(c); });
  failure.rethrow();
}

}  // namespace supine::diagnosis
