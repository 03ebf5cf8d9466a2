// SPDX-License-Identifier: AGPL-3.0-or-later
// What nuisances, uneven bodies and unknown forces do to the distances, against the chain solved again.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/signed_distance.h"
#include "diagnosis/evidence/discrepancy.h"
#include "diagnosis/evidence/hypotheses.h"
#include "diagnosis/evidence/linear_evidence.h"
#include "diagnosis/evidence/nuisances.h"
#include "diagnosis/evidence/patchiness.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;

struct Solved {
  Twin twin{{supine::testing::twin_truth(), 0.3}};
  simulation::Model model = supine::testing::twin_truth();
  calibration::Evaluator evaluator{twin.scene(), model, accurate_enough()};
  calibration::Prediction prediction = evaluator.predict(model);
  calibration::PointMask mask = calibration::points_over_skin(prediction);
  calibration::Residuals residuals = calibration::residuals_of(twin.scene(), prediction, mask, {0.3});
  simulation::Sensitivities sensitivities{evaluator.chain(), model, prediction.solution};

  Eigen::VectorXd distances_of(const simulation::Model& other) {
    return calibration::residuals_of(twin.scene(), evaluator.predict(other, &prediction.solution), mask, {0.3})
        .distance_mm;
  }
};

TEST(Nuisances, ShapesAreTheSlopesOfTheModelThatCarriesThem) {
  Solved solved;
  const std::vector<std::string> poses = {"prone", "supine"};
  const Priors priors;
  std::vector<Nuisance> all = nuisances_of(solved.model, poses, priors);
  find_shapes(solved.evaluator, solved.sensitivities, solved.model, solved.prediction, solved.residuals, all);
  for (const char* name :
       {"supine/misregistration.turn_x_rad", "supine/gravity_tilt.roll_rad", "supine/chest_wall_motion.amplitude_mm",
        "/adhesion.log_factor", "/incompressibility.log_factor", "/interface.normal_kpa_per_mm"}) {
    std::vector<Nuisance> moved = all;
    double step = 0;
    const Nuisance* of = nullptr;
    for (Nuisance& nuisance : moved)
      if (nuisance.name() == name) nuisance.value = step = 0.02, of = &nuisance;
    ASSERT_NE(of, nullptr) << name;
    const Eigen::VectorXd up = solved.distances_of(with_nuisances(solved.model, moved, poses));
    for (Nuisance& nuisance : moved) nuisance.value *= -1;
    const Eigen::VectorXd down = solved.distances_of(with_nuisances(solved.model, moved, poses));
    const Eigen::VectorXd slope = (up - down) / (2 * step);
    EXPECT_GT(slope.norm(), 1e-3) << name;
    EXPECT_LT((slope - of->shape_mm).norm(), 0.02 * slope.norm()) << name;
  }
}

TEST(Nuisances, MoveTheBodyAsTheModelThatCarriesThemIsMoved) {
  Solved solved;
  const std::vector<std::string> poses = {"prone", "supine"};
  std::vector<Nuisance> all = nuisances_of(solved.model, poses, {});
  find_shapes(solved.evaluator, solved.sensitivities, solved.model, solved.prediction, solved.residuals, all);
  for (const char* name : {"supine/gravity_tilt.roll_rad", "supine/chest_wall_motion.amplitude_mm",
                           "/segmentation_offset.offset_mm", "/interface.normal_kpa_per_mm"}) {
    std::vector<Nuisance> moved = all;
    const auto of = std::find_if(moved.begin(), moved.end(), [name](const Nuisance& n) { return n.name() == name; });
    ASSERT_NE(of, moved.end()) << name;
    of->value = 0.05;
    const simulation::ChainSolution there =
        solved.evaluator.predict(with_nuisances(solved.model, moved, poses), &solved.prediction.solution).solution;
    simulation::ChainSolution expected = solved.prediction.solution;
    move_along(*of, of->value, expected);
    const Points way = there.poses[0].x - solved.prediction.solution.poses[0].x;
    EXPECT_GT(way.norm(), 1e-3) << name;
    EXPECT_LT((there.poses[0].x - expected.poses[0].x).norm(), 0.05 * way.norm()) << name;
    EXPECT_LT((there.X - expected.X).norm(), 0.05 * way.norm()) << name;
    EXPECT_LT((there.prone - expected.prone).norm(), 0.05 * way.norm()) << name;
  }
}

TEST(Candidates, MoveTheBodyByFiveMillimetresAtTheMost) {
  Solved solved;
  std::vector<std::string> unseen;
  calibration::Fit fit;
  fit.prediction = solved.prediction;
  fit.residuals = solved.residuals;
  const std::vector<Candidate> candidates = find_candidates(solved.evaluator, solved.model, fit, unseen);
  const auto tilt =
      std::find_if(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.effect == "gravity_tilt"; });
  ASSERT_NE(tilt, candidates.end());
  const auto most = [&](double step) {
    simulation::ChainSolution moved = solved.prediction.solution;
    move_along(*tilt, 0, step, moved);
    return std::max((moved.poses[0].x - solved.prediction.solution.poses[0].x).rowwise().norm().maxCoeff(),
                    (moved.X - solved.prediction.solution.X).rowwise().norm().maxCoeff());
  };
  const double little = most(1e-3);
  EXPECT_GT(little, 0);
  EXPECT_NEAR(most(2e-3), 2 * little, 1e-6 * little);
  EXPECT_NEAR(most(1e3), 5, 1e-6);
  EXPECT_NEAR(most(-1e3), 5, 1e-6);
}

TEST(Nuisances, AreAsWideInAPoseAsWasSaidOfIt) {
  Priors priors;
  priors.of_pose["supine"] = {priors.known, priors.scan_shared_mm};
  priors.of_pose["supine"].known.registration_mm = 0.4;
  priors.of_pose["supine"].known.gravity_rad = 0;
  std::map<std::string, double> sigma;
  for (const Nuisance& n : nuisances_of(supine::testing::twin_truth(), {"prone", "supine", "tilt45"}, priors))
    sigma[n.name()] = n.sigma;
  EXPECT_EQ(sigma.at("supine/misregistration.shift_x_mm"), 0.4);
  EXPECT_EQ(sigma.at("tilt45/misregistration.shift_x_mm"), priors.known.registration_mm);
  EXPECT_FALSE(sigma.contains("supine/gravity_tilt.roll_rad")) << "known exactly";
  EXPECT_EQ(sigma.at("tilt45/gravity_tilt.roll_rad"), priors.known.gravity_rad);
}

TEST(Nuisances, WhatTheModelFitsOrHasAsAnEffectIsNotThereTwice) {
  simulation::Model model = supine::testing::twin_truth();
  const auto names_of = [&model] {
    std::vector<std::string> names;
    for (const Nuisance& n : nuisances_of(model, {"prone", "supine"}, {})) names.push_back(n.name());
    return names;
  };
  const auto has = [&](const std::string& name) {
    const auto names = names_of();
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  EXPECT_TRUE(has("/adhesion.log_factor"));
  EXPECT_TRUE(has("/cut.stiffness_kpa_per_mm"));
  EXPECT_FALSE(has("prone/misregistration.shift_x_mm")) << "the image lies where it lies";
  model.effects = {simulation::null_setting(*simulation::find_effect("adhesion")),
                   simulation::null_setting(*simulation::find_effect("misregistration"))};
  model.cut.stiffness_kpa_per_mm.free = true;
  EXPECT_FALSE(has("/adhesion.log_factor"));
  EXPECT_FALSE(has("/cut.stiffness_kpa_per_mm"));
  EXPECT_TRUE(has("supine/misregistration.shift_x_mm")) << "each scan still lies elsewhere in its own way";
}

TEST(Sensitivities, AlongADirectionOfTheFieldsAreThoseOfTheParameterThatChangesThemSo) {
  Solved solved;
  const simulation::ChainDerivative by_name = solved.sensitivities.of("breast.young_modulus_kpa");
  const double young = solved.model.breast.young_modulus_kpa.value;
  const simulation::ChainDerivative by_field =
      solved.sensitivities.along([young](const simulation::PoseLoad&, simulation::Fields<simulation::Dual>& fields) {
        for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c) fields.ln_young[c].v[0] = 1 / young;
      });
  EXPECT_LT((by_name.poses[0] - by_field.poses[0]).norm(), 1e-9 * by_name.poses[0].norm());
  EXPECT_LT((by_name.X - by_field.X).norm(), 1e-9 * by_name.X.norm());
}

TEST(Sensitivities, ForcesOnNodesMoveWhatTheTangentSays) {
  Solved solved;
  const Points& x = solved.prediction.solution.poses[0].x;
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(x.size());
  for (Eigen::Index n = 0; n < x.rows(); ++n) weight[3 * n + 1] = 1;
  const Points moved = solved.sensitivities.moved_by(0, weight);
  EXPECT_GT(moved.col(1).mean(), 0) << "with the force";
  simulation::Mechanics mechanics(solved.twin.mesh, solved.twin.anatomy, solved.model);
  mechanics.set_fields(simulation::values_of(solved.evaluator.chain().fields(solved.model, solved.twin.supine)));
  simulation::Sums sums(mechanics.pattern());
  const simulation::State state{x, solved.prediction.solution.X, 1.0};
  mechanics.evaluate(state, {.residual = true, .tangent = true}, sums);
  const Eigen::VectorXd back = sums.tangent * Eigen::Map<const Eigen::VectorXd>(moved.data(), moved.size());
  EXPECT_LT((back - weight).norm(), 1e-6 * weight.norm());
}

TEST(Patchiness, FieldsHaveTheSizesTheyAreGiven) {
  Solved solved;
  Patchiness size;
  size.tissue_length_mm = size.skin_length_mm = size.muscle_length_mm = 30;  // few shapes hold nearly all of a field
  const PatchyFields fields = patchy_fields(solved.evaluator.chain().mechanics(), size);
  const auto sd = [](const Eigen::MatrixXd& shapes) {
    return std::sqrt(shapes.squaredNorm() / static_cast<double>(shapes.rows()));
  };
  // What is taken out of them makes them smaller than they are given.
  for (const auto& [found, given] : {std::pair{sd(fields.tissue), size.tissue}, std::pair{sd(fields.skin), size.skin},
                                     std::pair{sd(fields.muscle), size.muscle_mm}}) {
    EXPECT_LT(found, 1.05 * given);
    EXPECT_GT(found, 0.7 * given);
  }
}

TEST(Patchiness, ShapesLeaveOutWhatTheModuliMakeUpForAndGrowWithTheirSize) {
  Solved solved;
  const auto shapes = [&solved](const Patchiness& size) {
    return patchiness_shapes(solved.evaluator.chain(), solved.sensitivities, solved.prediction, solved.residuals, size);
  };
  const Eigen::MatrixXd usual = shapes({});
  EXPECT_GT(usual.cols(), 30);
  Patchiness twice;
  twice.tissue *= 2, twice.skin *= 2, twice.muscle_mm *= 2;
  EXPECT_LT((shapes(twice) - 2 * usual).norm(), 1e-9 * usual.norm());
  // Each of the three fields moves the skin by itself.
  double of_all = 0;
  for (const Patchiness& alone : {Patchiness{.skin = 0, .muscle_mm = 0}, Patchiness{.tissue = 0, .muscle_mm = 0},
                                  Patchiness{.tissue = 0, .skin = 0}}) {
    const double square = shapes(alone).squaredNorm();
    EXPECT_GT(square, 1e-3 * usual.squaredNorm());
    of_all += square;
  }
  EXPECT_NEAR(of_all, usual.squaredNorm(), 1e-9 * usual.squaredNorm());
  const double rms = std::sqrt(usual.squaredNorm() / static_cast<double>(usual.rows()));
  EXPECT_GT(rms, 0.05);
  EXPECT_LT(rms, 3);
}

// A nuisance of the effect's own kind says a part of its usual size: the secant is of the rest, as if of all.
TEST(Secants, GoOnFromWhatANuisanceSays) {
  Solved solved;
  BaseFit base;
  base.noise_mm = {0.3};
  base.fit.prediction = solved.prediction;
  base.fit.mask = solved.mask;
  base.fit.residuals = solved.residuals;
  const Eigen::VectorXd at_rest = base.fit.residuals.distance_mm;
  base.model = solved.model;
  const simulation::Parameter& row = *simulation::find_parameter("adhesion.log_factor");
  const double usual = row.median - row.null;
  const auto secant = [&](double share) {
    base.nuisances = {{"springs", "", "adhesion", "log_factor", 0.5 * usual, {}, 2 * share}};
    std::vector<Candidate> candidates = {
        {"adhesion",
         {{"adhesion.log_factor", row.unit, row.null, row.lower, row.upper, usual, row.one_sided}},
         {},
         {}}};
    find_secants(solved.twin.scene(), base, base, candidates);
    return candidates[0];
  };
  for (const double share : {0.0, 0.4}) {
    const Candidate found = secant(share);
    EXPECT_NEAR(found.secant_to, (1 - share) * usual, 1e-12);
    simulation::Model moved = solved.model;
    moved.effects.push_back(simulation::null_setting(*simulation::find_effect("adhesion")));
    moved.effects.back().parameters["log_factor"].value = row.null + (1 - share) * usual;
    const Eigen::VectorXd change = solved.distances_of(moved) - at_rest;
    EXPECT_LT(((1 - share) * found.secant - change).norm(), 1e-3 * change.norm());
  }
  EXPECT_EQ(secant(0.8).secant_to, 0);  // a fifth is left: the slope is as good
}

TEST(Discrepancy, HasAMeanSquareOfOneAndIsACovariance) {
  Solved solved;
  const calibration::Clusters clusters = calibration::cluster_points(solved.residuals, 200);
  const Eigen::MatrixXd kernel =
      discrepancy_of(solved.twin.mesh, solved.sensitivities, solved.prediction, solved.residuals, clusters).kernel;
  EXPECT_NEAR(kernel.diagonal().mean(), 1, 1e-9);
  EXPECT_LT((kernel - kernel.transpose()).norm(), 1e-9 * kernel.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(kernel).eigenvalues()[0], -1e-9 * kernel.norm());
}

/// Twins whose scan is off by white noise alone, which then is all that their distances are.
struct Noisy {
  static constexpr double noise_mm = 1.5;
  Twin twin{{supine::testing::twin_truth(), noise_mm}};
  simulation::Model model = supine::testing::twin_truth();
  calibration::Evaluator evaluator{twin.scene(), model, accurate_enough()};
  calibration::Prediction prediction = evaluator.predict(model);
  calibration::Residuals residuals =
      calibration::residuals_of(twin.scene(), prediction, calibration::points_over_skin(prediction), {noise_mm});
  calibration::Clusters clusters = calibration::cluster_points(residuals, 600);
  Eigen::VectorXd y = clusters.means(residuals.distance_mm);
};

TEST(Clusters, LieOnTheSkinHoweverFarTheScanIsOff) {
  Noisy noisy;
  const calibration::ModelSkin skin(noisy.twin.mesh, noisy.prediction.solution.poses[0].x);
  calibration::SignedDistances off;
  calibration::scan_to_model(skin, noisy.clusters.place, off);
  const Eigen::VectorXd a = off.distance_mm.array() - off.distance_mm.mean(), b = noisy.y.array() - noisy.y.mean();
  EXPECT_LT(std::abs(a.dot(b)), 0.1 * b.squaredNorm());
}

TEST(Discrepancy, ExplainsNoNoise) {
  Noisy noisy;
  const simulation::Sensitivities sensitivities(noisy.evaluator.chain(), noisy.model, noisy.prediction.solution);
  const Eigen::MatrixXd kernel =
      discrepancy_of(noisy.twin.mesh, sensitivities, noisy.prediction, noisy.residuals, noisy.clusters).kernel;
  const Eigen::MatrixXd errors = (std::pow(Noisy::noise_mm, 2) * noisy.clusters.members.cwiseInverse()).asDiagonal();
  const ErrorCovariance covariance(errors, kernel, 1, 10);
  const double none = covariance.sizes_mm()[0], large = covariance.sizes_mm().tail<1>()[0];
  EXPECT_GT(covariance.square(noisy.y, large), 0.75 * covariance.square(noisy.y, none));
}

}  // namespace
}  // namespace supine::diagnosis
