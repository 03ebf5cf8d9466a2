// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/missing_effects.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/error.h"
#include "common/first_failure.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<std::string> names_in(const Hypothesis& h, const std::vector<Candidate>& candidates) {
  std::vector<std::string> names;
  for (const int effect : h.effects) names.push_back(candidates[static_cast<std::size_t>(effect)].effect);
  std::sort(names.begin(), names.end());
  return names;
}

bool has_effect(const simulation::Model& model, const std::string& name) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [&name](const simulation::EffectSetting& setting) { return setting.name == name; });
}

VectorXd flat(const Points& points) { return Eigen::Map<const VectorXd>(points.data(), points.size()); }

/// The body in the pose with the one number of an effect at its usual size.
Points shape_at_usual_size(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const PoseAt& at,
                           const Candidate& candidate) {
  const std::string& pose = at.chain.poses()[1].name;
  if (candidate.secant_at)
    for (const simulation::PoseSolution& solved : candidate.secant_at->poses)
      if (solved.name == pose) return solved.x;
  simulation::Model model = at.model;
  model.effects.push_back(simulation::null_setting(*simulation::find_effect(candidate.effect)));
  const simulation::Parameter& row = *simulation::find_parameter(candidate.parameters[0].name);
  model.effects.back().parameters[row.name].value = row.null + candidate.secant_to;
  simulation::Chain chain(mesh, anatomy, model, at.chain.poses(), accurate_enough());
  return chain.solve(model, &at.solution).poses[0].x;
}

/// Row of the nuisance that an effect stands for by itself, or -1.
Index replaced_row(const std::vector<Nuisance>& nuisances, Index before, const std::string& effect) {
  for (std::size_t k = 0; k < nuisances.size(); ++k)
    if (nuisances[k].effect == effect && nuisances[k].pose.empty()) return before + static_cast<Index>(k);
  return -1;
}

}  // namespace

std::vector<LikelySet> MissingEffects::likeliest(std::size_t most) const {
  std::vector<LikelySet> sets;
  for (const Hypothesis& h : hypotheses)
    if (sets.size() < most) sets.push_back({names_in(h, candidates), h.probability});
  return sets;
}

MissingEffects screen_effects(calibration::Evaluator& evaluator, const BaseFit& base, const Priors& priors) {
  MissingEffects missing;
  std::vector<std::string> unseen;
  missing.candidates = find_candidates(evaluator, base.model, base.fit, unseen);
  find_secants(evaluator.scene(), base, base, missing.candidates, true);
  missing.hypotheses = Screening(base, missing.candidates, priors).hypotheses();
  return missing;
}

std::vector<std::string> weigh_as(const std::vector<LikelySet>& told, const simulation::Model& model,
                                  MissingEffects& missing) {
  std::map<std::vector<std::string>, double> wanted;
  std::vector<std::string> unknown;
  for (const LikelySet& set : told) {
    std::vector<std::string> names;
    for (const std::string& name : set.effects) {
      if (has_effect(model, name)) continue;
      names.push_back(name);
      const bool known = std::any_of(missing.candidates.begin(), missing.candidates.end(),
                                     [&name](const Candidate& candidate) { return candidate.effect == name; });
      if (!known) unknown.push_back(name);
    }
    std::sort(names.begin(), names.end());
    wanted[names] += set.probability;
  }
  double followed = 0, others = 0;
  for (const Hypothesis& h : missing.hypotheses) {
    const auto own = wanted.find(names_in(h, missing.candidates));
    own == wanted.end() ? others += h.probability : followed += own->second;
  }
  const double left = std::max(0.0, 1 - followed);
  for (Hypothesis& h : missing.hypotheses) {
    const auto own = wanted.find(names_in(h, missing.candidates));
    h.probability = own != wanted.end() ? own->second : others > 0 ? h.probability * left / others : 0;
  }
  std::stable_sort(missing.hypotheses.begin(), missing.hypotheses.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.probability > b.probability; });
  return unknown;
}

BelievedEffects believed_effects(const simulation::Model& model, const meshing::TetMesh& mesh,
                                 const meshing::Anatomy& anatomy, Index parameters,
                                 const std::vector<Nuisance>& nuisances, const Priors& priors, bool any) {
  BelievedEffects believed;
  if (any) believed.candidates = lacking_effects(model, mesh, anatomy);
  const Index before = parameters + static_cast<Index>(nuisances.size());
  std::vector<std::string> names;
  std::vector<std::vector<int>> own;
  for (Candidate& candidate : believed.candidates) {
    names.push_back(candidate.effect);
    own.emplace_back();
    for (const CandidateParameter& number : candidate.parameters) {
      const StrengthPrior prior = strength_prior(*simulation::find_parameter(number.name));
      own.back().push_back(static_cast<int>(before) + static_cast<int>(believed.numbers.size()));
      believed.numbers.push_back({candidate.effect, number.name, number.null, prior.mean() - number.null, prior.sd(),
                                  prior.log_normal ? std::optional(0.0) : std::nullopt});
      if (candidate.parameters.size() == 1) candidate.secant_to = prior.median - number.null;
    }
  }
  const auto add = [&](const std::vector<int>& set) {
    DirectionSet directions;
    directions.rows = first_rows(static_cast<Eigen::Index>(before));
    LikelySet likely{{}, std::exp(priors.ln_of_set(names, set))};
    for (const int effect : set) {
      const auto e = static_cast<std::size_t>(effect);
      std::erase(directions.rows, static_cast<int>(replaced_row(nuisances, parameters, names[e])));
      directions.rows.insert(directions.rows.end(), own[e].begin(), own[e].end());
      likely.effects.push_back(names[e]);
    }
    directions.size_probability = VectorXd::Constant(1, likely.probability);
    believed.sets.push_back(std::move(likely)), believed.rows.push_back(std::move(directions));
  };
  add({});
  const int count = static_cast<int>(names.size());
  for (int a = 0; a < count; ++a) add({a});
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b) add({a, b});
  double whole = 0;
  for (const LikelySet& set : believed.sets) whole += set.probability;
  for (LikelySet& set : believed.sets) set.probability /= whole;
  for (DirectionSet& set : believed.rows) set.size_probability /= whole;
  return believed;
}

MatrixXd effect_moves(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const PoseAt& at,
                      const simulation::Embedding& points, const std::vector<Candidate>& candidates) {
  std::vector<Index> first;
  Index count = 0;
  for (const Candidate& candidate : candidates) {
    first.push_back(count);
    count += static_cast<Index>(candidate.parameters.size());
  }
  MatrixXd moves(3 * points.outside_mm().size(), count);
  std::vector<char> along_secant(candidates.size(), 0);
  const VectorXd here = flat(points.at(at.x()));
  FirstFailure failure;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t c = 0; c < candidates.size(); ++c)
    failure.guard([&] {
      if (candidates[c].secant_to == 0) return;
      try {
        moves.col(first[c]) =
            (flat(points.at(shape_at_usual_size(mesh, anatomy, at, candidates[c]))) - here) / candidates[c].secant_to;
        along_secant[c] = 1;
      } catch (const NumericalFailure&) {
        // No equilibrium at the usual size: the slope has to do.
      }
    });
  failure.rethrow();
  for (std::size_t c = 0; c < candidates.size(); ++c)
    for (std::size_t k = 0; k < candidates[c].parameters.size() && !along_secant[c]; ++k)
      moves.col(first[c] + static_cast<Index>(k)) =
          flat(points.at(at.sensitivities.of(candidates[c].parameters[k].name).poses[0]));
  return moves;
}

}  // namespace supine::diagnosis
