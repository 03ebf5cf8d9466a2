// SPDX-License-Identifier: AGPL-3.0-or-later
// How often 95 % regions of places hold the truth of small breasts whose effects and nuisances are drawn from their
// priors: bench_twin_coverage TWINS [FIRST_SEED] [null|effects]. The truth lies on the model's own mesh.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"
#include "diagnosis/targets/regions.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using supine::testing::Twin;

constexpr double noise_mm = 0.3;

Points places_in(const meshing::TetMesh& mesh) {
  constexpr Index count = 20;
  Points places(count, 3);
  for (Index p = 0; p < count; ++p)
    places.row(p) =
        mesh.points(mesh.cells.row((2 * p + 1) * mesh.cells.rows() / (2 * count)).head(4), Eigen::all).colwise().mean();
  return places;
}

/// How many effects a case has.
int effects_of(const std::string& kind, const Priors& priors, std::mt19937_64& generator) {
  if (kind == "null") return 0;
  auto weights = priors.of_sets;
  if (kind == "effects") weights[0] = 0;
  return std::discrete_distribution<int>(weights.begin(), weights.end())(generator);
}

/// Numbers of effects as their priors have them, what is never known too.
simulation::Model drawn_truth(const std::string& kind, const Priors& priors, std::mt19937_64& generator,
                              std::vector<std::string>& names) {
  static const Twin plain({supine::testing::twin_truth()});
  std::normal_distribution<double> normal;
  simulation::Model model = supine::testing::twin_truth();
  auto nuisances = nuisances_of(model, {"prone", "supine"}, priors);
  auto candidates = lacking_effects(model, plain.mesh, plain.anatomy);
  // The scan of a twin lies where the body lies.
  std::erase_if(candidates, [](const Candidate& c) { return simulation::traits_of(c.effect).moves_scan; });
  std::shuffle(candidates.begin(), candidates.end(), generator);
  candidates.resize(static_cast<std::size_t>(effects_of(kind, priors, generator)));
  for (Nuisance& nuisance : nuisances) {
    const bool replaced = std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
      return c.effect == nuisance.effect && nuisance.pose.empty();
    });
    nuisance.value = replaced ? 0 : normal(generator);
  }
  model = with_nuisances(model, nuisances, {"prone", "supine"});
  for (const Candidate& candidate : candidates) {
    names.push_back(candidate.effect);
    model.effects.push_back(simulation::null_setting(*simulation::find_effect(candidate.effect)));
    for (const CandidateParameter& number : candidate.parameters) {
      const simulation::Parameter& row = *simulation::find_parameter(number.name);
      const StrengthPrior prior = strength_prior(row);
      const double value = prior.log_normal ? prior.median * std::exp(prior.spread * normal(generator))
                                            : prior.median + prior.spread * normal(generator);
      model.effects.back().parameters[row.name].value = std::clamp(value, row.lower, row.upper);
    }
  }
  return model;
}

/// What came of all places of some cases.
struct Tally {
  int places = 0, held = 0, held_if_nothing = 0, cases = 0;
  double square = 0, axis = 0, axis_if_nothing = 0;

  void print(const std::string& group) const {
    if (places == 0) return;
    const double n = places;
    fmt::print(
        "{}: {} bodies; in their region {} of {} ({:.1f} %), as if nothing were missing {} ({:.1f} %); error {:.2f} "
        "mm per axis, longest half axis {:.2f} mm in the mean, as if nothing were missing {:.2f}\n",
        group, cases, held, places, 100 * held / n, held_if_nothing, 100 * held_if_nothing / n,
        std::sqrt(square / (3 * n)), axis / n, axis_if_nothing / n);
  }
};

bool holds(const Vector3d& centre, const Eigen::Matrix3d& covariance, double longest_mm, const Vector3d& point) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  const double reach = longest_mm / std::sqrt(eigen.eigenvalues()[2]);
  const Vector3d off = point - centre;
  return off.dot(covariance.ldlt().solve(off)) <= reach * reach;
}

void examine_one(unsigned seed, const std::string& kind, Tally& null, Tally& with) {
  const Priors priors;
  std::mt19937_64 generator(seed);
  std::vector<std::string> names;
  const simulation::Model truth = drawn_truth(kind, priors, generator, names);
  const Twin twin({truth, noise_mm, seed});
  const simulation::Model start = supine::testing::twin_start();
  const TargetQuestion question{
      &twin.mesh, &twin.anatomy, twin.prone, twin.supine, std::vector<std::string>(20, "p"), places_in(twin.mesh)};
  calibration::Evaluator evaluator(twin.scene(), start, accurate_enough());
  BaseFitOptions options;
  options.other_meshes = false;
  const BaseFit base = fit_base_model(evaluator, start, start, {noise_mm}, nullptr, options);
  const TargetRegions regions =
      find_regions(question, evaluator, base, screen_effects(evaluator, base, priors), priors);
  const Points there = simulation::Embedding(twin.mesh, question.imaged).at(twin.solution.poses[0].x);
  Tally& tally = names.empty() ? null : with;
  ++tally.cases;
  int held = 0, if_nothing = 0;
  for (std::size_t p = 0; p < regions.points.size(); ++p) {
    const TargetRegion& r = regions.points[p];
    const Vector3d point = there.row(static_cast<Index>(p));
    held += holds(r.place_mm, r.covariance, r.half_axes_mm[0], point);
    if_nothing += holds(r.if_nothing_missing.place_mm, r.if_nothing_missing.covariance,
                        r.if_nothing_missing.half_axes_mm[0], point);
    tally.square += (point - r.place_mm).squaredNorm();
    tally.axis += r.half_axes_mm[0], tally.axis_if_nothing += r.if_nothing_missing.half_axes_mm[0];
  }
  tally.places += static_cast<int>(regions.points.size()), tally.held += held, tally.held_if_nothing += if_nothing;
  fmt::print("{} {}: held {} (as if nothing {}), likeliest {} ({:.2f}), unexplained {:.2f} mm\n", seed,
             fmt::join(names, "+"), held, if_nothing, fmt::join(regions.sets[0].effects, "+"),
             regions.sets[0].probability, regions.unexplained_mm);
  std::fflush(stdout);
}

}  // namespace
}  // namespace supine::diagnosis

int main(int argc, char** argv) {
  using namespace supine::diagnosis;
  const int twins = argc > 1 ? std::atoi(argv[1]) : 20, first = argc > 2 ? std::atoi(argv[2]) : 1;
  const std::string kind = argc > 3 ? argv[3] : "prior";
  Tally null, with;
  for (int k = 0; k < twins; ++k) try {
      examine_one(static_cast<unsigned>(first + k), kind, null, with);
    } catch (const supine::NumericalFailure& failure) {
      fmt::print("{}: no equilibrium ({})\n", first + k, failure.what());
    }
  null.print("nothing missing");
  with.print("effects that the model lacks");
}
