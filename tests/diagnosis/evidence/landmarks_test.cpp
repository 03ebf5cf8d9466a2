// SPDX-License-Identifier: AGPL-3.0-or-later
// Landmarks as part of the measurement: their rows, their slopes, and what only they can tell.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/rms.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/mesh_doubt.h"
#include "diagnosis/evidence/nuisances.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;

/// A twin whose supine landmarks are where the truth carries some points of the imaged body.
struct Marked {
  Twin twin{{supine::testing::twin_truth(), 0.3}};
  calibration::MeasuredLandmarks marks;

  explicit Marked(double sigma_mm = 0.5) {
    const Points& imaged = twin.mesh.points;
    const std::vector<int> nodes = {0, static_cast<int>(imaged.rows() / 3), static_cast<int>(imaged.rows() - 1)};
    marks = {{"a", "b", "c"}, imaged(nodes, Eigen::all), twin.solution.poses[0].x(nodes, Eigen::all), {}};
    marks.sigma_mm = Eigen::VectorXd::Constant(3, sigma_mm);
  }
  calibration::MeasuredScene scene() const {
    calibration::MeasuredScene scene = twin.scene();
    scene.landmarks = {&marks};
    return scene;
  }
};

TEST(LandmarkRows, AreMeasuredLessPredictedPlaceBehindThoseOfTheSkin) {
  Marked marked;
  marked.marks.measured.row(1) += Eigen::RowVector3d(0.25, -1, 2);
  const simulation::Model truth = supine::testing::twin_truth();
  calibration::Evaluator evaluator(marked.scene(), truth, accurate_enough());
  const calibration::Prediction prediction = evaluator.predict(truth);
  const auto mask = calibration::points_over_skin(prediction);
  const auto rows = calibration::residuals_of(marked.scene(), prediction, mask, {0.3});
  ASSERT_EQ(rows.landmark_rows, 9);
  EXPECT_EQ(rows.skin_rows(), mask[0].count());
  const Eigen::VectorXd tail = rows.distance_mm.tail(9);
  EXPECT_LT((tail.segment(3, 3) - Eigen::Vector3d(0.25, -1, 2)).norm(), 1e-3);
  EXPECT_LT(tail.head(3).norm() + tail.tail(3).norm(), 1e-3) << "the truth carries them there";
  EXPECT_EQ(rows.sigma_mm.tail(9), Eigen::VectorXd::Constant(9, 0.5));
  const calibration::Clusters clusters = calibration::cluster_points(rows, 100);
  const Eigen::Index last = clusters.members.size() - 1;
  EXPECT_EQ(clusters.kind[last], 3);
  EXPECT_EQ(clusters.members.tail(9), Eigen::VectorXd::Ones(9)) << "each by itself";
  EXPECT_FALSE(clusters.related(last, last - 1)) << "x, y and z of a landmark err one by one";
  EXPECT_TRUE(clusters.related(last, last - 3));
}

TEST(LandmarkRows, SlopesAreThoseOfTheModelSolvedAgain) {
  const Marked marked;
  const simulation::Model truth = supine::testing::twin_truth();
  calibration::Evaluator evaluator(marked.scene(), truth, accurate_enough());
  const calibration::Prediction prediction = evaluator.predict(truth);
  const auto mask = calibration::points_over_skin(prediction);
  const auto at = [&](const simulation::Model& model) {
    return calibration::residuals_of(marked.scene(), evaluator.predict(model, &prediction.solution), mask, {0.3});
  };
  const auto rows = at(truth);
  const simulation::Sensitivities sensitivities(evaluator.chain(), truth, prediction.solution);
  Priors priors;
  std::vector<Nuisance> all = nuisances_of(truth, {"prone", "supine"}, priors);
  find_shapes(evaluator, sensitivities, truth, prediction, rows, all);
  for (const char* name :
       {"supine/misregistration.turn_y_rad", "supine/gravity_tilt.roll_rad", "/adhesion.log_factor"}) {
    std::vector<Nuisance> moved = all;
    const auto found = std::find_if(moved.begin(), moved.end(), [&](const Nuisance& n) { return n.name() == name; });
    ASSERT_NE(found, moved.end()) << name;
    found->value = 0.02;
    const Eigen::VectorXd up = at(with_nuisances(truth, moved, {"prone", "supine"})).distance_mm.tail(9);
    found->value = -0.02;
    const Eigen::VectorXd down = at(with_nuisances(truth, moved, {"prone", "supine"})).distance_mm.tail(9);
    const Eigen::VectorXd slope = (up - down) / 0.04;
    EXPECT_GT(slope.norm(), 1e-2) << name;
    EXPECT_LT((slope - found->shape_mm.tail(9)).norm(), 0.02 * slope.norm()) << name;
  }
  const simulation::ChainDerivative by_modulus = sensitivities.of("breast.young_modulus_kpa");
  const Eigen::VectorXd slope =
      calibration::slope_at(evaluator, truth, prediction, rows, "breast.young_modulus_kpa", by_modulus);
  EXPECT_LT((slope - calibration::distance_change(prediction, rows, by_modulus.poses)).norm(), 1e-9 * slope.norm())
      << "a parameter that moves no scan does what its motion of the nodes does";
}

/// Mean and standard deviation of one nuisance after the fit of the base model.
std::pair<double, double> found_in(const calibration::MeasuredScene& scene, const std::string& name) {
  const simulation::Model start = supine::testing::twin_start();
  calibration::Evaluator evaluator(scene, start, accurate_enough());
  BaseFitOptions options;
  options.other_meshes = false;
  const BaseFit base = fit_base_model(evaluator, start, start, {0.3}, nullptr, options);
  EXPECT_LT(rms(base.fit.residuals.skin_mm()), 1.0);
  const LinearEvidence evidence(*base.covariance, base.distances(base.fit.residuals),
                                directions_at(base.fit, *base.parameters, base.nuisances, base.clusters));
  std::vector<int> rows;
  int of = -1;
  for (int k = 0; k < static_cast<int>(evidence.directions().size()); ++k) {
    if (evidence.directions().names[static_cast<std::size_t>(k)] == name) of = k;
    rows.push_back(k);
  }
  const auto [offset, sd] = evidence.weigh(rows).number(of);
  return {evidence.directions().stands[of] + evidence.directions().unit[of] * offset,
          evidence.directions().unit[of] * sd};
}

TEST(LandmarkRows, ErrByWhatTheirFilesSayAndNoMore) {
  const Marked marked(0.5);
  const simulation::Model truth = supine::testing::twin_truth();
  calibration::Evaluator evaluator(marked.scene(), truth, accurate_enough());
  BaseFitOptions options;
  options.other_meshes = false;
  options.priors.patchiness = {.tissue = 0, .skin = 0, .muscle_mm = 0};
  const BaseFit base = fit_base_model(evaluator, truth, truth, {0.3}, nullptr, options);
  const Eigen::Index count = base.errors.rows();
  EXPECT_LT((base.errors.bottomRightCorner(9, 9) - 0.25 * Eigen::MatrixXd::Identity(9, 9)).norm(), 1e-12);
  EXPECT_EQ(base.errors.bottomLeftCorner(9, count - 9).norm(), 0) << "no error of the scanner is in them";
}

TEST(JointPosterior, HoldsTheTruthOfATwin) {
  const Marked marked(0.5);
  const simulation::Model start = supine::testing::twin_start();
  simulation::Model truth = supine::testing::twin_truth();
  calibration::Evaluator evaluator(marked.scene(), start, accurate_enough());
  BaseFitOptions options;
  options.other_meshes = false;
  const BaseFit base = fit_base_model(evaluator, start, start, {0.3}, nullptr, options);
  const JointPosterior posterior = posterior_of(base);
  ASSERT_EQ(posterior.of_parameters.rows(), base.fit.u.size());
  for (Eigen::Index k = 0; k < base.fit.u.size(); ++k) {
    const auto row = static_cast<std::size_t>(k);
    const double wanted = simulation::find_setting(truth, posterior.names[row])->value;
    const double unit = base.parameters->slope(base.fit.u)[k];
    EXPECT_NEAR(posterior.sd[k], unit * std::sqrt(posterior.of_parameters(k, k)), 1e-9 * posterior.sd[k]);
    EXPECT_NEAR(posterior.value[k], wanted, 3 * posterior.sd[k]) << posterior.names[row];
    EXPECT_LT(posterior.sd[k], wanted) << "something is known of it";
  }
}

TEST(JointPosterior, IsWiderByWhatTheMeshDoes) {
  const Marked marked(0.5);
  const simulation::Model start = supine::testing::twin_start();
  calibration::Evaluator evaluator(marked.scene(), start, accurate_enough());
  BaseFitOptions options;
  options.other_meshes = false;
  BaseFit base = fit_base_model(evaluator, start, start, {0.3}, nullptr, options);
  const JointPosterior exact = posterior_of(base);
  base.numerical.emplace();  // another mesh that shows nothing
  const JointPosterior allowed = posterior_of(base);
  const Eigen::VectorXd unit = base.parameters->slope(base.fit.u);
  int wider = 0;
  for (Eigen::Index k = 0; k < exact.sd.size(); ++k) {
    const std::string& name = exact.names[static_cast<std::size_t>(k)];
    const double doubt = mesh_doubt(name.substr(name.find('/') + 1));
    if (!(doubt > 0)) {
      EXPECT_EQ(allowed.sd[k], exact.sd[k]) << name;
      continue;
    }
    ++wider;
    const bool modulus = k < exact.of_parameters.rows();
    const double added = modulus ? doubt * std::abs(unit[k]) : doubt;
    EXPECT_GT(allowed.sd[k], exact.sd[k]) << name;
    EXPECT_LT(allowed.sd[k], 1.001 * std::hypot(exact.sd[k], added)) << name;
    if (modulus) {
      EXPECT_EQ(allowed.value[k], exact.value[k]) << name;
    }
  }
  EXPECT_GE(wider, 7) << "a modulus and six numbers of a scan's place";
  const auto correlation = [](const Eigen::MatrixXd& c) { return c(0, 1) / std::sqrt(c(0, 0) * c(1, 1)); };
  if (exact.of_parameters.rows() > 1) {
    EXPECT_NEAR(correlation(allowed.of_parameters), correlation(exact.of_parameters), 1e-12);
  }
}

TEST(LandmarkRows, HelpToTellWhereAScanLies) {
  const Marked marked(0.3);
  for (const char* number : {"shift_x_mm", "shift_z_mm", "turn_x_rad", "turn_y_rad", "turn_z_rad"}) {
    const std::string name = std::string("supine/misregistration.") + number;
    const auto [with, sd_with] = found_in(marked.scene(), name);
    const auto [without, sd_without] = found_in(marked.twin.scene(), name);
    EXPECT_LT(sd_with, 0.95 * sd_without) << name;
    EXPECT_LT(std::abs(with), 3 * sd_with) << name << ": the scan lies in its place";
    EXPECT_LT(std::abs(without), 3 * sd_without) << name;
  }
}

TEST(LandmarkRows, PullTheScanAlong) {
  Marked marked(0.1);
  marked.marks.measured.col(2).array() += 1;
  const std::string name = "supine/misregistration.shift_z_mm";
  EXPECT_GT(found_in(marked.scene(), name).first, found_in(marked.twin.scene(), name).first + 0.2);
}

}  // namespace
}  // namespace supine::diagnosis
