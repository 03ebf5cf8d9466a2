// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/numerical_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/free_parameters.h"
#include "common/error.h"
#include "common/rms.h"
#include "diagnosis/creases.h"
#include "diagnosis/other_mesh.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;
using supine::testing::twin_truth;

/// A fit of its truth to a twin, on the twin's mesh.
struct Fitted {
  Fitted() : twin({twin_truth(), 0.3}), parameters(twin_truth()), evaluator(twin.scene(), twin_truth()) {
    calibration::FitOptions options;
    options.noise_mm = {0.3};
    fit = calibration::evaluate_fit(evaluator, parameters, options, parameters.start());
  }
  Twin twin;
  calibration::FreeParameters parameters;
  calibration::Evaluator evaluator;
  calibration::Fit fit;
};

TEST(CorrelationLength, IsThatOfAFieldBetweenFiveAndSixtyMillimetres) {
  const Fitted f;
  const calibration::Residuals& r = f.fit.residuals;
  const auto length_of = [&r](double mm) {
    const Eigen::Vector3d wave = Eigen::Vector3d(1, 0.6, 0.3).normalized();
    const Eigen::ArrayXd phase = (r.place * wave).array() / mm;
    return correlation_length_mm(r, (phase.cos() + phase.sin()).matrix());
  };
  EXPECT_EQ(correlation_length_mm(r, Eigen::VectorXd::Ones(r.size())), 60);
  EXPECT_EQ(correlation_length_mm(r, Eigen::VectorXd::Zero(r.size())), 5);
  EXPECT_LT(length_of(4), length_of(8));
  EXPECT_LT(length_of(8), length_of(20));
  // Places 10 mm apart on a plane: J₀(10/8) = 0.646 alike, and 10 mm / −ln 0.646 = 23 mm.
  EXPECT_NEAR(length_of(8), 23, 5);
}

TEST(NumericalError, IsWhatTwoOtherMeshesChange) {
  const Fitted f;
  const NumericalError error = measure_numerical_error(f.twin.scene(), twin_truth(), f.fit);
  EXPECT_EQ(error.finer_failure + error.coarser_failure, "");
  EXPECT_GT(error.spread_mm, 0);
  const double points = static_cast<double>(f.fit.residuals.size());
  EXPECT_NEAR(error.spread_mm * error.spread_mm * points,
              std::pow(error.finer_doubt, 2) * error.finer_mm.squaredNorm() + error.coarser_mm.squaredNorm(), 1e-9);
  EXPECT_NEAR(error.share.squaredNorm(), points, 1e-6);
  EXPECT_GE(error.share.minCoeff(), 0.4) << "no place is without error";
  EXPECT_GT(error.share.maxCoeff(), 1.2) << "places differ";
}

/// The skin beyond a plane was twice as long: it is pressed together there as if it had folded.
TEST(NumericalError, OfCreasesSaysNothingOfTheRestOfTheSkin) {
  Fitted f;
  const Points& x = f.fit.prediction.solution.poses[0].x;
  const double plane = x.col(0).mean();
  Points& X = f.fit.prediction.solution.X = x;
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    if (X(i, 0) > plane) X(i, 0) += X(i, 0) - plane;
  const auto smooth =
      (crease_error(f.twin.scene(), f.fit.prediction, f.fit.residuals).sd_mm.array() == 0).cast<double>().eval();
  ASSERT_LT(smooth.mean(), 0.8);
  const NumericalError error = measure_numerical_error(f.twin.scene(), twin_truth(), f.fit);
  const Eigen::ArrayXd square =
      std::pow(error.finer_doubt, 2) * error.finer_mm.array().square() + error.coarser_mm.array().square();
  EXPECT_NEAR(error.spread_mm, std::sqrt((square * smooth).sum() / smooth.sum()), 1e-9);
  EXPECT_NEAR((error.share.array().square() * smooth).sum(), smooth.sum(), 1e-6);
  EXPECT_GT(std::abs(error.spread_mm - std::sqrt(square.mean())), 0.01 * error.spread_mm);
}

/// Scan by quadratic elements, model of the linear ones of the same shapes.
struct LinearOfQuadratic {
  LinearOfQuadratic() : twin(quadratic_twin()), scene(twin.scene()) {
    scene.mesh = &supine::testing::dome_scene().mesh;
    scene.anatomy = &supine::testing::dome_scene().anatomy;
    calibration::Evaluator evaluator(scene, twin_truth());
    const calibration::FreeParameters parameters(twin_truth());
    calibration::FitOptions options;
    options.noise_mm = {0.05};
    fit = calibration::evaluate_fit(evaluator, parameters, options, parameters.start());
  }

  static Twin::Options quadratic_twin() {
    Twin::Options options{twin_truth(), 0.05};
    options.body = &supine::testing::dome_scene(2);
    return options;
  }

  Twin twin;
  calibration::MeasuredScene scene;
  calibration::Fit fit;
};

TEST(NumericalError, TakesAwayWhatLinearElementsErrAndSaysWhatIsLeft) {
  const LinearOfQuadratic f;
  const NumericalError error = measure_numerical_error(f.scene, twin_truth(), f.fit);
  EXPECT_EQ(error.finer_failure + error.coarser_failure, "");
  const Eigen::VectorXd& d = f.fit.residuals.distance_mm;
  ASSERT_GT(rms(d), 0.2) << "linear elements err";
  const double left = rms(d + error.finer_mm);
  EXPECT_LT(left, 0.2 * rms(d));
  EXPECT_GT(error.spread_mm, 0.6 * left);
  EXPECT_LT(error.spread_mm, rms(d));
}

TEST(NumericalError, BothOrdersOnACoarserMeshTakeAwayHalfOfIt) {
  const LinearOfQuadratic f;
  NumericalError near;  // as if quadratic elements of the given mesh had led nowhere
  near.coarse = std::make_shared<const meshing::TetMesh>(coarser_mesh(*f.scene.mesh, *f.scene.anatomy, 0.5));
  const meshing::Anatomy anatomy = meshing::compute_anatomy(*near.coarse, f.scene.anatomy->side);
  calibration::MeasuredScene scene = f.scene;
  scene.mesh = near.coarse.get();
  scene.anatomy = &anatomy;
  near.linear = calibration::Evaluator(scene, twin_truth()).predict(twin_truth(), nullptr).solution;
  const NumericalError error = measure_numerical_error(f.scene, twin_truth(), f.fit, &near);
  EXPECT_EQ(error.coarse, near.coarse);
  EXPECT_EQ(error.finer_failure + error.coarser_failure, "");
  const Eigen::VectorXd& d = f.fit.residuals.distance_mm;
  const double left = rms(d + error.finer_mm);
  EXPECT_LT(left, 0.6 * rms(d));
  const double wanted = -d.dot(error.finer_mm) / error.finer_mm.squaredNorm();  // times it would leave least
  EXPECT_GT(wanted, 0.9) << "not too much is taken away";
  EXPECT_LT(wanted, 1.9);
  EXPECT_GT(error.spread_mm, 0.9 * rms(d));
  EXPECT_LT(error.spread_mm, 1.5 * rms(d));
}

TEST(NumericalError, DoesNotDependOnWhereTheSolutionIsLookedForFrom) {
  const LinearOfQuadratic f;
  simulation::Model stiffer = twin_truth();
  stiffer.breast.young_modulus_kpa.value *= 1.3;
  calibration::Evaluator evaluator(f.scene, stiffer);
  const calibration::FreeParameters parameters(stiffer);
  calibration::FitOptions options;
  options.noise_mm = {0.05};
  const calibration::Fit fit = calibration::evaluate_fit(evaluator, parameters, options, parameters.start());
  const NumericalError near = measure_numerical_error(f.scene, twin_truth(), f.fit);
  const NumericalError alone = measure_numerical_error(f.scene, stiffer, fit);
  const NumericalError followed = measure_numerical_error(f.scene, stiffer, fit, &near);
  EXPECT_GT(std::abs(rms(alone.finer_mm) - rms(near.finer_mm)), 0.01) << "the error differs";
  EXPECT_LT(rms(alone.finer_mm - followed.finer_mm), 0.002);
}

calibration::Fit fit_at(const calibration::MeasuredScene& scene, const simulation::Model& model) {
  calibration::Evaluator evaluator(scene, model);
  const calibration::FreeParameters parameters(model);
  calibration::FitOptions options;
  options.noise_mm = {0.05};
  return calibration::evaluate_fit(evaluator, parameters, options, parameters.start());
}

TEST(NumericalError, OfQuadraticElementsIsFollowedOnTheSameMeshes) {
  const Twin twin(LinearOfQuadratic::quadratic_twin());
  const calibration::MeasuredScene scene = twin.scene();
  simulation::Model stiffer = twin_truth();
  stiffer.breast.young_modulus_kpa.value *= 1.3;
  const calibration::Fit fit = fit_at(scene, stiffer);
  const NumericalError near = measure_numerical_error(scene, twin_truth(), fit_at(scene, twin_truth()));
  const NumericalError alone = measure_numerical_error(scene, stiffer, fit);
  const NumericalError followed = measure_numerical_error(scene, stiffer, fit, &near);
  ASSERT_EQ(followed.finer_failure + followed.coarser_failure, "");
  EXPECT_EQ(followed.on_finer.mesh, near.on_finer.mesh);
  EXPECT_EQ(followed.on_coarser.mesh, near.on_coarser.mesh);
  EXPECT_LT(rms(alone.finer_mm - followed.finer_mm), 0.005);
  EXPECT_LT(rms(alone.coarser_mm - followed.coarser_mm), 0.005);
  EXPECT_GT(rms(alone.coarser_mm), 0.02) << "there is something to follow";
  NumericalError unsolved;  // there was no equilibrium on the mesh before
  unsolved.on_coarser.mesh = near.on_coarser.mesh;
  const NumericalError solved = measure_numerical_error(scene, stiffer, fit, &unsolved);
  EXPECT_EQ(solved.coarser_failure, "");
  EXPECT_LT(rms(alone.coarser_mm - solved.coarser_mm), 0.005);
}

TEST(NumericalError, IsTakenToBeLargeWhereNoMeshGivesAnAnswer) {
  const Fitted f;
  meshing::TetMesh crossed = f.twin.mesh;  // its nipple pulled through its muscle: no surface to fill anew
  crossed.points.row(f.twin.anatomy.nipple_point) -= 200 * f.twin.anatomy.outward.transpose();
  calibration::MeasuredScene scene = f.twin.scene();
  scene.mesh = &crossed;
  const NumericalError error = measure_numerical_error(scene, twin_truth(), f.fit);
  EXPECT_NE(error.finer_failure, "");
  EXPECT_NE(error.coarser_failure, "");
  EXPECT_EQ(rms(error.finer_mm), 0);
  EXPECT_DOUBLE_EQ(error.spread_mm, largest_share_of_way * way_mm(f.fit.prediction.solution));
  EXPECT_GT(error.spread_mm, 0.1);
}

}  // namespace
}  // namespace supine::diagnosis
