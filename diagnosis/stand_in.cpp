// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/stand_in.h"

#include <algorithm>

#include "calibration/work_limit.h"
#include "common/error.h"
#include "common/first_failure.h"
#include "common/statistics.h"
#include "diagnosis/candidates.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/fit_errors.h"
#include "diagnosis/evidence/set_refit.h"
#include "diagnosis/score_test.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double lines_agree = 0.5;  // of λ from one end to that from the other
constexpr int most_steps = 8;

/// λ of a change that linear steps along the slopes may make up for, all whitened.
double left_of(const VectorXd& change, const MatrixXd& slope) {
  const MatrixXd absorbed = orthonormal_basis(slope);
  return (change - absorbed * (absorbed.transpose() * change)).squaredNorm();
}

class Imitation {
 public:
  Imitation(const calibration::MeasuredScene& scene, const BaseFit& base, const FitErrors& errors, const Priors& priors,
            const std::vector<Candidate>& candidates)
      : scene_(scene), base_(base), priors_(priors), candidates_(candidates), metric_(errors.metric()) {
    metric_.mean_mm = -base.fit.residuals.distance_mm;
    slope_ = metric_.whitening->apply(base.fit.linearisation.slope);
  }

  /// Of the sign that is seen less.
  std::shared_ptr<const StandIn> of(const Candidate& candidate) const {
    const CandidateParameter& number = candidate.parameters[0];
    std::shared_ptr<const StandIn> least;
    double least_seen = 0;
    for (const double size : {number.typical, -number.typical}) {
      if (size < 0 && (number.one_sided || candidate.secant.size() > 0)) break;
      auto one = with_size(candidate, size);
      if (!one) continue;
      const double seen = metric_.whitening->apply(one->left_mm).squaredNorm();
      if (!least || seen < least_seen) least = std::move(one), least_seen = seen;
    }
    return least;
  }

 private:
  std::shared_ptr<const StandIn> with_size(const Candidate& candidate, double size) const {
    const FreeParameters there(model_with(candidate, size));
    const bool expected = priors_.is_expected(candidate.effect);
    const VectorXd change = candidate.secant.size() > 0 ? candidate.secant : VectorXd(size * candidate.slope.col(0));
    if (!expected && candidate.no_secant) return nullptr;
    const double along_lines = left_of(metric_.whitening->apply(change), slope_);
    if (!expected && !settles(along_lines, 1)) return nullptr;
    calibration::Evaluator evaluator(scene_, there.base(), expected ? accurate_enough() : accurate_enough_far_away());
    WeightedFit fit;
    {
      // Of an effect that the case does not expect it is a figure beside the verdict: worth one solve from nothing.
      const calibration::TrialLimit limit(evaluator.chain(), expected ? 2 * base_.dearest : 2 * base_.dearest / 3);
      const simulation::ChainSolution start = near(candidate, size);
      fit = weigh(evaluator, there, metric_, start_of(there), &start);
    }
    if (!expected &&
        left_of(white(fit), metric_.whitening->apply(fit.solution.linearisation.slope)) > lines_agree * along_lines)
      return nullptr;
    descend(evaluator, there, metric_, {.max_iterations = most_steps}, fit);
    const VectorXd left = fit.solution.residuals.distance_mm + metric_.mean_mm;
    return std::make_shared<StandIn>(StandIn{there.model(fit.solution.u), std::move(fit.solution.prediction.solution),
                                             left, made_up(there, fit.solution.u)});
  }

  /// The shape at that size where a secant was drawn to it, else along the line to it.
  simulation::ChainSolution near(const Candidate& candidate, double size) const {
    if (candidate.secant_at && size == candidate.parameters[0].typical) return *candidate.secant_at;
    simulation::ChainSolution moved = base_.fit.prediction.solution;
    move_along(candidate, 0, size, moved);
    return moved;
  }

  /// The base model with the effect at a size; of one that is expected with the others that are, free.
  simulation::Model model_with(const Candidate& candidate, double size) const {
    simulation::Model model = with_nuisances(base_.parameters->base(), base_.nuisances, poses_of(scene_));
    const CandidateParameter& number = candidate.parameters[0];
    model.effects.push_back(simulation::null_setting(*simulation::find_effect(candidate.effect)));
    model.effects.back().parameters[simulation::find_parameter(number.name)->name].value = number.null + size;
    for (const Candidate& other : candidates_)
      if (priors_.is_expected(candidate.effect) && priors_.is_expected(other.effect) &&
          other.effect != candidate.effect)
        model.effects.push_back(free_setting(other.effect));
    return model;
  }

  VectorXd start_of(const FreeParameters& there) const {
    VectorXd u = there.start();
    for (Index i = 0; i < u.size(); ++i)
      if (const Index own = row_of(there.names()[static_cast<std::size_t>(i)]); own >= 0) u[i] = base_.fit.u[own];
    return u;
  }

  std::vector<MadeUp> made_up(const FreeParameters& there, const VectorXd& u) const {
    std::vector<MadeUp> list;
    for (Index i = 0; i < u.size(); ++i) {
      const std::string& name = there.names()[static_cast<std::size_t>(i)];
      const Index own = row_of(name);
      const simulation::Parameter* row = simulation::find_parameter(name);
      if (own < 0 && row->shape) continue;
      const double from = own < 0 ? row->null : base_.parameters->value(own, base_.fit.u[own]);
      list.push_back({name, there.unit(i), from, there.value(i, u[i])});
    }
    return list;
  }

  /// Of a free parameter of the base model; -1: it has none of that name.
  Index row_of(const std::string& name) const {
    const auto& own = base_.parameters->names();
    const auto at = std::find(own.begin(), own.end(), name);
    return at == own.end() ? -1 : at - own.begin();
  }

  VectorXd white(const WeightedFit& fit) const {
    return metric_.whitening->apply(fit.solution.residuals.distance_mm + metric_.mean_mm);
  }

  const calibration::MeasuredScene& scene_;
  const BaseFit& base_;
  const Priors& priors_;
  const std::vector<Candidate>& candidates_;
  Metric metric_;
  MatrixXd slope_;  // whitened, of the base model
};

}  // namespace

void find_stand_ins(const calibration::MeasuredScene& scene, const BaseFit& base, const FitErrors& errors,
                    const Priors& priors, std::vector<Candidate>& candidates) {
  const Imitation imitation(scene, base, errors, priors, candidates);
  std::vector<std::shared_ptr<const StandIn>> found(candidates.size());
  FirstFailure failure;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t c = 0; c < candidates.size(); ++c)
    failure.guard([&] {
      if (candidates[c].parameters.size() != 1) return;
      try {
        found[c] = imitation.of(candidates[c]);
      } catch (const NumericalFailure&) {
        // No equilibrium at the usual size or on the way: lines have to do.
      }
    });
  failure.rethrow();
  for (std::size_t c = 0; c < candidates.size(); ++c) candidates[c].stand_in = std::move(found[c]);
}

}  // namespace supine::diagnosis
