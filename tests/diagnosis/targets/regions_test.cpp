// SPDX-License-Identifier: AGPL-3.0-or-later
// Where points inside a twin lie, and how sure that is.
#include "diagnosis/targets/regions.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>

#include "common/statistics.h"
#include "diagnosis/evidence/mean_kernel.h"
#include "diagnosis/targets/draws.h"
#include "diagnosis/targets/further_scan.h"
#include "diagnosis/targets/joint_moves.h"
#include "diagnosis/targets/moves.h"
#include "diagnosis/targets/places.h"
#include "diagnosis/targets/shape_draws.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;

/// Middles of some cells, spread over the body.
Points inside(const meshing::TetMesh& mesh) {
  Points points(4, 3);
  for (int p = 0; p < 4; ++p)
    points.row(p) = mesh.points(mesh.cells.row((p + 1) * mesh.cells.rows() / 5).head(4), Eigen::all).colwise().mean();
  return points;
}

struct Asked {
  explicit Asked(const simulation::Model& truth = supine::testing::twin_truth()) : twin({truth, 0.3}) {}
  Twin twin;
  TargetQuestion question{&twin.mesh, &twin.anatomy, twin.prone, twin.supine, {"a", "b", "c", "d"}, inside(twin.mesh)};
  Points truth() const { return simulation::Embedding(twin.mesh, question.imaged).at(twin.solution.poses[0].x); }
};

/// A fit of the twin's scan, without other meshes: the truth lies on this one.
struct Fitted : Asked {
  using Asked::Asked;
  simulation::Model start = supine::testing::twin_start();
  calibration::Evaluator evaluator{twin.scene(), start, accurate_enough()};
  Priors priors;
  BaseFit base = fit();
  BaseFit fit() {
    BaseFitOptions options;
    options.other_meshes = false;
    return fit_base_model(evaluator, start, start, {0.3}, nullptr, options);
  }
};

TEST(PointMoves, AreThoseOfTheModelSolvedAgain) {
  const Asked asked;
  const simulation::Model model = supine::testing::twin_truth();
  const auto* mesh = asked.question.mesh;
  const auto* anatomy = asked.question.anatomy;
  const auto &prone = asked.question.prone, &pose = asked.question.pose;
  const Points& imaged = asked.question.imaged;
  const PointMoves moves = [&] {
    PoseAt at(*mesh, *anatomy, prone, pose, model, nullptr);
    const calibration::FreeParameters free(model);
    return moves_of(at, simulation::Embedding(*mesh, imaged), free, free.start(),
                    nuisances_of(model, {"prone", "supine"}, {}), {}, {});
  }();
  const calibration::FreeParameters free(model);
  const auto nuisances = nuisances_of(model, {"prone", "supine"}, {});
  simulation::Chain chain(*mesh, *anatomy, model, {prone, pose}, accurate_enough());
  const simulation::ChainSolution near = chain.solve(model);
  const auto places = [&](const simulation::Model& at) -> Eigen::VectorXd {
    const Points there = simulation::Embedding(*mesh, imaged).at(chain.solve(at, &near).poses[0].x);
    return Eigen::Map<const Eigen::VectorXd>(there.data(), there.size());
  };
  constexpr double step = 1e-3;
  for (Eigen::Index i = 0; i < free.size(); ++i) {
    Eigen::VectorXd up = free.start(), down = free.start();
    up[i] += step, down[i] -= step;
    const Eigen::VectorXd slope = (places(free.model(up)) - places(free.model(down))) / (2 * step);
    EXPECT_GT(slope.norm(), 1e-2);
    EXPECT_LT((slope - moves.parameters.col(i)).norm(), 1e-3 * slope.norm()) << i;
  }
  int moved = 0;
  for (std::size_t k = 0; k < nuisances.size(); ++k) {
    std::vector<Nuisance> up = nuisances, down = nuisances;
    up[k].value = step, down[k].value = -step;
    const Eigen::VectorXd slope = (places(with_nuisances(model, up, {"prone", "supine"})) -
                                   places(with_nuisances(model, down, {"prone", "supine"}))) /
                                  (2 * step);
    moved += slope.norm() > 1e-2;
    EXPECT_LT((slope - moves.nuisances.col(static_cast<Eigen::Index>(k))).norm(), 2e-3 * slope.norm() + 1e-4)
        << nuisances[k].name();
  }
  EXPECT_GE(moved, 5) << "gravity, breath, skin, springs";
}

TEST(ShapeDraws, KernelsOfDistancesAndPlacesAreMovedTogetherAndStayACovariance) {
  Fitted f;
  const simulation::PoseLoad &prone = f.question.prone, &pose = f.question.pose;
  const auto nuisances = with_those_of(f.base.model, f.base.nuisances, prone.name, pose.name, f.priors);
  MeasuredPart measured = measured_part(f.evaluator, f.base, {}, f.priors, nuisances);
  const PoseAt at(f.twin.mesh, f.twin.anatomy, prone, pose, f.base.model, &f.base.fit.prediction.solution);
  const Places places = places_of(f.twin.mesh, f.question.imaged, at.x(), -pose.gravity);
  const PointMoves moves = moves_of(at, simulation::Embedding(f.twin.mesh, places.imaged), *f.base.parameters,
                                    f.base.fit.u, nuisances, f.priors.patchiness, measured.discrepancy.forces);
  JointMoves joint = measured.joint;
  fill_kernels(f.base, measured.discrepancy, moves.forces, places.there, 0, joint);
  const JointMoves at_fit = joint;
  allow_for_shapes(f.twin.scene(), f.base, {&f.twin.mesh, &f.twin.anatomy, prone, pose, 0, &places}, joint);
  EXPECT_LT((joint.data_kernel - mean_kernel(f.twin.scene(), f.base)).norm(), 1e-9 * joint.data_kernel.norm());
  const auto moved = [](const Eigen::MatrixXd& now, const Eigen::MatrixXd& before) {
    return (now - before).norm() / before.norm();
  };
  for (const double share :
       {moved(joint.cross_kernel, at_fit.cross_kernel), moved(joint.target_kernel, at_fit.target_kernel)}) {
    EXPECT_GT(share, 1e-4);
    EXPECT_LT(share, 0.2);
  }
  const Eigen::Index n = joint.data_kernel.rows(), t = joint.target_kernel.rows();
  Eigen::MatrixXd together(n + t, n + t);
  together << joint.data_kernel, joint.cross_kernel.transpose(), joint.cross_kernel, joint.target_kernel;
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(together).eigenvalues()[0], -1e-9 * together.norm());
}

TEST(PlacesOfTargets, NearestSkinAndTheSkinAboveAreOnTheSkin) {
  const Asked asked;
  const Points& x = asked.twin.solution.poses[0].x;
  const Eigen::Vector3d up = -asked.twin.supine.gravity;
  const Places places = places_of(asked.twin.mesh, asked.question.imaged, x, up);
  const calibration::ModelSkin skin(asked.twin.mesh, x);
  calibration::ClosestPoints closest;
  skin.closest(places.there, closest);
  int over = 0;
  for (Eigen::Index p = 0; p < 4; ++p) {
    const Eigen::Vector3d target = places.there.row(p), near = places.there.row(4 + p), above = places.there.row(8 + p);
    double least = 1e9;
    for (const int node : skin.nodes()) least = std::min(least, (x.row(node).transpose() - target).norm());
    EXPECT_LE((near - target).norm(), least + 1e-9) << "no node of the skin is nearer";
    if (!places.has_straight[static_cast<std::size_t>(p)]) continue;
    ++over;
    EXPECT_NEAR((above - target).normalized().dot(up), 1, 1e-9) << "straight up";
    EXPECT_GE((above - target).norm(), (near - target).norm() - 1e-9);
  }
  EXPECT_GE(over, 3);
}

TEST(TargetRegionsOfATwin, HoldTheTruthAndAreTighterThanWithoutTheScan) {
  Fitted fitted;
  fitted.question.further_scans = true;
  const TargetRegions known = find_regions(fitted.question, fitted.evaluator, fitted.base, {}, fitted.priors);
  const TargetRegions guessed = find_regions(fitted.question, fitted.start, false, fitted.priors);
  EXPECT_TRUE(known.measured);
  EXPECT_FALSE(guessed.measured);
  const Points truth = fitted.truth();
  for (std::size_t p = 0; p < 4; ++p) {
    const TargetRegion& region = known.points[p];
    const Eigen::Vector3d off = truth.row(static_cast<Eigen::Index>(p)).transpose() - region.place_mm;
    EXPECT_LT(off.dot(region.covariance.ldlt().solve(off)), chi_squared_quantile(3, 0.999)) << region.name;
    EXPECT_LT(region.sd_mm(), 0.8 * guessed.points[p].sd_mm()) << region.name;
    EXPECT_GT(region.half_axes_mm[2], 0);
    // Over sizes of the unexplained the tails are longer than a normal's, but not by much.
    EXPECT_NEAR(std::pow(region.half_axes_mm.norm(), 2) / region.covariance.trace(), chi_squared_quantile(3, 0.95), 1);
    ASSERT_TRUE(region.nearest);
    EXPECT_GT(region.nearest->sd_mm, 0);
    EXPECT_LT(region.nearest->sd_mm, region.half_axes_mm[0]);
    ASSERT_FALSE(region.shrinks.empty());
    for (std::size_t k = 0; k < region.shrinks.size(); ++k) {
      EXPECT_GE(region.shrinks[k].share, -1e-9) << region.shrinks[k].what;
      EXPECT_LT(region.shrinks[k].share, 1) << region.shrinks[k].what;
      if (k > 0) {
        EXPECT_LE(region.shrinks[k].share, region.shrinks[k - 1].share);
      }
    }
  }
  const auto scan = [](const TargetRegion& region) {
    return std::any_of(region.shrinks.begin(), region.shrinks.end(),
                       [](const Shrink& shrink) { return shrink.what.starts_with("scan "); });
  };
  EXPECT_TRUE(std::any_of(known.points.begin(), known.points.end(), scan));
}

TEST(JointMovesOfAPose, ThatWasNotMeasuredHoldWhatIsKnownAndItsOwnNuisancesBehind) {
  Fitted fitted;
  const auto nuisances = with_those_of(fitted.base.model, fitted.base.nuisances, "prone", "tilt45", fitted.priors);
  const auto own = static_cast<Eigen::Index>(nuisances.size() - fitted.base.nuisances.size());
  ASSERT_GT(own, 0);
  const JointMoves joint = measured_part(fitted.evaluator, fitted.base, {}, fitted.priors, nuisances).joint;
  const Eigen::Index all = fitted.base.fit.u.size() + static_cast<Eigen::Index>(nuisances.size());
  ASSERT_EQ(joint.data.cols(), all);
  ASSERT_EQ(joint.mean.size(), all);
  EXPECT_TRUE(joint.data.rightCols(own).isZero(0)) << "they move no measured distance";
  EXPECT_EQ(
      joint.data.leftCols(all - own),
      directions_at(fitted.base.fit, *fitted.base.parameters, fitted.base.nuisances, fitted.base.clusters).columns);
  EXPECT_EQ(joint.sd.tail(own), Eigen::VectorXd::Ones(own));
  ASSERT_EQ(joint.sets.size(), 1u);
  EXPECT_EQ(joint.sets[0].rows.size(), static_cast<std::size_t>(all));
  EXPECT_EQ(joint.sets[0].rows.back(), all - 1);
  // Errors are those of the fit, its uneven bodies but for where they are measured once more.
  const double patches = (fitted.base.patches * fitted.base.patches.transpose()).norm();
  EXPECT_LT((joint.data_errors - fitted.base.errors).norm(), 0.3 * patches);
}

TEST(FurtherScanOfATwin, ErrsByScannerAndMeshAlikeWhereItIsClose) {
  const Asked asked;
  const simulation::Model model = supine::testing::twin_truth();
  PoseAt at(asked.twin.mesh, asked.twin.anatomy, asked.twin.prone, asked.twin.supine, model, nullptr);
  const calibration::FreeParameters free(model);
  const auto scan = [&](double mesh_share, double shared_mm) {
    Priors priors;
    priors.scan_shared_mm = shared_mm;
    return further_scan(at, asked.twin.mesh, free, free.start(), {}, priors, {}, mesh_share).errors;
  };
  const Eigen::MatrixXd noise = scan(0, 0), mesh = scan(0.1, 0) - noise, shared = scan(0, 0.5) - noise;
  EXPECT_GT(noise.diagonal().minCoeff(), 0);
  EXPECT_TRUE((noise - Eigen::MatrixXd(noise.diagonal().asDiagonal())).isZero(1e-12)) << "place by place";
  const double variance = std::pow(0.1 * at.way_mm(), 2);
  EXPECT_LT((mesh.diagonal().array() / variance - 1).abs().maxCoeff(), 1e-6);
  EXPECT_LT((shared.diagonal().array() / 0.25 - 1).abs().maxCoeff(), 1e-6);
  for (const auto& [errors, most] : {std::pair{mesh, variance}, std::pair{shared, 0.25}}) {
    EXPECT_GT((errors - Eigen::MatrixXd(errors.diagonal().asDiagonal())).maxCoeff(), 0.1 * most);
    EXPECT_LT(errors.minCoeff(), 0.5 * most) << "less alike far apart";
  }
}

/// Whether an ellipsoid holds a point.
bool holds(const TargetRegion& region, const Eigen::Vector3d& point) {
  return (region.axes.transpose() * (point - region.place_mm)).cwiseQuotient(region.half_axes_mm).norm() <= 1;
}

TEST(TargetRegionsOfATwin, HoldTheTruthThatTheModelLacks) {
  simulation::Model truth = supine::testing::twin_truth();
  truth.effects.push_back(simulation::null_setting(*simulation::find_effect("gravity_tilt")));
  truth.effects.back().parameters.at("pitch_rad").value = 0.25;
  Fitted fitted(truth);
  const MissingEffects missing = screen_effects(fitted.evaluator, fitted.base, fitted.priors);
  const TargetRegions over_all = find_regions(fitted.question, fitted.evaluator, fitted.base, missing, fitted.priors);
  const TargetRegions if_nothing = find_regions(fitted.question, fitted.evaluator, fitted.base, {}, fitted.priors);
  EXPECT_TRUE(if_nothing.sets.empty());
  ASSERT_FALSE(over_all.sets.empty());
  const Points places = fitted.truth();
  double variance = 0, variance_if_nothing = 0;
  for (int p = 0; p < 4; ++p) {
    const TargetRegion &all = over_all.points[static_cast<std::size_t>(p)],
                       &nothing = if_nothing.points[static_cast<std::size_t>(p)];
    EXPECT_TRUE(holds(all, places.row(p).transpose())) << p;
    variance += all.covariance.trace(), variance_if_nothing += nothing.covariance.trace();
    EXPECT_LT((all.if_nothing_missing.place_mm - nothing.place_mm).norm(), 1e-6);
  }
  EXPECT_GT(variance, variance_if_nothing);
  // What a diagnosis knows better: it was the tilt.
  MissingEffects known = missing;
  EXPECT_TRUE(weigh_as({{{"gravity_tilt"}, 0.97}, {{}, 0.01}}, fitted.start, known).empty());
  EXPECT_NEAR(known.likeliest(1)[0].probability, 0.97, 1e-12);
  double sum = 0;
  for (const Hypothesis& h : known.hypotheses) sum += h.probability;
  EXPECT_NEAR(sum, 1, 1e-9);
  const TargetRegions diagnosed = find_regions(fitted.question, fitted.evaluator, fitted.base, known, fitted.priors);
  int tilts = 0;
  for (int p = 0; p < 4; ++p) {
    const TargetRegion& region = diagnosed.points[static_cast<std::size_t>(p)];
    EXPECT_TRUE(holds(region, places.row(p).transpose())) << p;
    std::set<std::string> what;  // both angles of a tilt become known together
    for (const Shrink& shrink : region.shrinks) EXPECT_TRUE(what.insert(shrink.what).second) << shrink.what;
    tilts += static_cast<int>(what.count("gravity_tilt"));
  }
  EXPECT_GT(tilts, 0);
  EXPECT_EQ(weigh_as({{{"left_right_stiffness"}, 0.5}}, fitted.start, known),
            (std::vector<std::string>{"left_right_stiffness"}));
}

TEST(EffectMoves, AreThoseOfTheModelWithTheEffect) {
  const Asked asked;
  const simulation::Model model = supine::testing::twin_truth();
  const auto* mesh = asked.question.mesh;
  const auto* anatomy = asked.question.anatomy;
  PoseAt at(*mesh, *anatomy, asked.question.prone, asked.question.pose, model, nullptr);
  const simulation::Embedding points(*mesh, asked.question.imaged);
  std::vector<Candidate> candidates;
  for (Candidate& candidate : lacking_effects(model, *mesh, *anatomy))
    if (candidate.effect == "ligament" || candidate.effect == "gravity_tilt")
      candidates.push_back(std::move(candidate));
  ASSERT_EQ(candidates.size(), 2u);
  candidates[0].secant_to = 0.2;  // kPa/mm
  const Eigen::MatrixXd found = effect_moves(*mesh, *anatomy, at, points, candidates);
  const auto moved = [&](const std::string& name, double by) -> Eigen::VectorXd {
    simulation::Model with = model;
    const simulation::Effect& effect = *simulation::find_effect(name.substr(0, name.find('.')));
    with.effects.push_back(simulation::null_setting(effect));
    simulation::find_setting(with, name)->value += by;
    simulation::Chain chain(*mesh, *anatomy, with, {asked.question.prone, asked.question.pose}, accurate_enough());
    const Points off = points.at(chain.solve(with, &at.solution).poses[0].x) - points.at(at.x());
    return Eigen::Map<const Eigen::VectorXd>(off.data(), off.size()) / by;
  };
  ASSERT_EQ(found.cols(), 1 + static_cast<Eigen::Index>(candidates[1].parameters.size()));
  EXPECT_LT((found.col(0) - moved("ligament.stiffness_kpa_per_mm", 0.2)).norm(), 1e-3 * found.col(0).norm());
  for (std::size_t k = 0; k < candidates[1].parameters.size(); ++k) {
    const Eigen::VectorXd slope = moved(candidates[1].parameters[k].name, 1e-3);
    EXPECT_GT(slope.norm(), 1);
    EXPECT_LT((found.col(1 + static_cast<Eigen::Index>(k)) - slope).norm(), 1e-2 * slope.norm());
  }
}

TEST(TargetRegionsOfATwin, WithoutAScanAreWiderWhereTheModelMayLackSomething) {
  const Asked asked;
  const simulation::Model start = supine::testing::twin_start();
  const TargetRegions nothing = find_regions(asked.question, start, false, {});
  const TargetRegions anything = find_regions(asked.question, start, true, {});
  ASSERT_FALSE(anything.sets.empty());
  EXPECT_TRUE(anything.sets.front().effects.empty());
  EXPECT_NEAR(anything.sets.front().probability, 0.5 / 0.95, 1e-9);
  double sum = 0, sum_if_nothing = 0;
  for (std::size_t p = 0; p < 4; ++p) {
    sum += anything.points[p].sd_mm(), sum_if_nothing += nothing.points[p].sd_mm();
    EXPECT_NEAR(anything.points[p].if_nothing_missing.half_axes_mm[0], nothing.points[p].half_axes_mm[0],
                0.02 * nothing.points[p].half_axes_mm[0]);
  }
  EXPECT_GT(sum, sum_if_nothing);
}

TEST(TargetRegionsOfATwin, AreWhatDrawsThroughTheChainSpread) {
  Fitted fitted;
  const TargetRegions known = find_regions(fitted.question, fitted.evaluator, fitted.base, {}, fitted.priors);
  const DrawnPlaces drawn =
      draw_places(fitted.question, *fitted.base.parameters, known, &fitted.base.fit.prediction.solution, 60, 1);
  EXPECT_EQ(drawn.draws, 60);
  EXPECT_LE(drawn.failed, 3);
  for (Eigen::Index p = 0; p < 4; ++p) {
    EXPECT_GT(drawn.linear_sd_mm[p], 0.05);
    EXPECT_NEAR(drawn.drawn_sd_mm[p] / drawn.linear_sd_mm[p], 1, 0.3) << p;
    EXPECT_LT(drawn.mean_off_mm[p], drawn.linear_sd_mm[p]);
    EXPECT_GE(drawn.inside[p], 0.75);
  }
}

TEST(TargetRegionsOfATwin, LandmarksThatLieElsewhereAreTold) {
  Asked asked;
  const Points& imaged = asked.twin.mesh.points;
  const std::vector<int> nodes = {0, static_cast<int>(imaged.rows() / 3), static_cast<int>(imaged.rows() - 1)};
  calibration::MeasuredLandmarks marks{{"a", "b", "c"},
                                       imaged(nodes, Eigen::all),
                                       asked.twin.solution.poses[0].x(nodes, Eigen::all),
                                       Eigen::VectorXd::Constant(3, 1.0)};
  const auto told = [&] {
    calibration::MeasuredScene scene = asked.twin.scene();
    scene.landmarks = {&marks};
    const simulation::Model start = supine::testing::twin_start();
    calibration::Evaluator evaluator(scene, start, accurate_enough());
    BaseFitOptions options;
    options.other_meshes = false;
    const BaseFit base = fit_base_model(evaluator, start, start, {0.3}, nullptr, options);
    return *find_regions(asked.question, evaluator, base, {}, {}).landmarks;
  };
  const ExpectedLandmarks right = told();
  EXPECT_GT(right.agreement.p_value, 0.05);
  EXPECT_LT((right.expected.places - marks.measured).norm(), 3 * std::sqrt(right.expected.covariance.trace()));
  const Points kept = marks.measured;
  marks.measured.row(0) += Eigen::RowVector3d(9, 0, -9);
  EXPECT_LT(told().agreement.p_value, 0.01);
  // A wrong scale: all of them spread, which a large unexplained field would swallow if they were asked of its size.
  const Eigen::RowVector3d middle = kept.colwise().mean();
  marks.measured = (1.3 * (kept.rowwise() - middle)).rowwise() + middle;
  EXPECT_LT(told().agreement.p_value, 0.01);
}

}  // namespace
}  // namespace supine::diagnosis
