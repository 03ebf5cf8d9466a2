// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/turning.h"

#include <gtest/gtest.h>

#include "simulation/solve/chain.h"
#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

const Eigen::Vector3d anterior(0, -1, 0), posterior(0, 1, 0);

TEST(Turning, GravityGoesOverTheOuterSideAtItsFullSize) {
  const Turn turn = turn_of(testing::dome_scene().anatomy, anterior, posterior);
  EXPECT_NEAR(turn.over.dot(testing::dome_scene().anatomy.lateral), 1, 0.1);
  EXPECT_NEAR(turn.angle_deg(), 180, 1e-9);
  EXPECT_LT((turn.gravity_at(0) - anterior).norm(), 1e-15);
  EXPECT_EQ(turn.gravity_at(180), posterior);
  EXPECT_LT((turn.gravity_at(90) - turn.over).norm(), 1e-12);
  for (double deg = 0; deg < 180; deg += 7) {
    EXPECT_NEAR(turn.gravity_at(deg).norm(), 1, 1e-14);
    EXPECT_NEAR(turn.gravity_at(deg).dot(anterior), std::cos(deg * 3.14159265358979 / 180), 1e-9);
  }
}

TEST(Turning, TwoBreastsTurnOverTheFeet) {
  const Turn turn = turn_of(testing::two_breasts_scene().anatomy, anterior, posterior);
  EXPECT_LT((turn.over - Eigen::Vector3d(0, 0, -1)).norm(), 0.1);
}

TEST(Turning, APoseNearbyIsReachedStraight) {
  const Eigen::Vector3d tilted(0, std::sqrt(0.5), -std::sqrt(0.5)), feet(0, 0, -1);
  const Turn turn = turn_of(testing::dome_scene().anatomy, feet, tilted);
  EXPECT_NEAR(turn.angle_deg(), 45, 1e-9);
  EXPECT_LT(std::abs(turn.gravity_at(20).x()), 1e-15);
}

struct Turned {
  const testing::TestScene& scene = testing::dome_scene();
  Model model = testing::soft_model();
  std::vector<PoseLoad> poses = {{"prone", anterior}, {"supine", posterior}};

  /// From the prone shape, with the undeformed one of @p solution. @param x  out
  std::optional<SolveReport> turned_over(const ChainSolution& solution, Points& x, int most_work) const {
    Mechanics mechanics(scene.mesh, scene.anatomy, model);
    EquilibriumSolver solver(mechanics);
    const Chain chain(scene.mesh, scene.anatomy, model, poses);
    const auto load = [&](const Eigen::Vector3d& gravity) {
      mechanics.set_fields(values_of(chain.fields(model, {"supine", gravity})));
    };
    x = solution.prone;
    return turn_over(solver, turn_of(scene.anatomy, anterior, posterior), load, solution.X, x, "turn", most_work);
  }
  ChainSolution solved() const {
    Chain chain(scene.mesh, scene.anatomy, model, poses);
    return chain.solve(model);
  }
};

TEST(Turning, EndsInTheShapeThatLoadStepsFind) {
  const Turned body;
  const ChainSolution solution = body.solved();
  Points x;
  const auto report = body.turned_over(solution, x, SolveOptions().most_work);
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->turned);
  EXPECT_GE(report->load_steps, 4);
  EXPECT_LT((x - solution.poses[0].x).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT((x - solution.prone).cwiseAbs().maxCoeff(), 5) << "a way worth the name";
}

TEST(Turning, AWayThatCostsTooMuchIsNoAnswer) {
  const Turned body;
  const ChainSolution solution = body.solved();
  Points x;
  EXPECT_FALSE(body.turned_over(solution, x, 3));
}

// So few Newton steps that the whole load at once leads nowhere: a chain turns the body instead.
TEST(Turning, AChainTurnsWhereGrowingGravityLeadsNowhere) {
  Turned body;
  body.model.breast.young_modulus_kpa.value = 0.4;
  body.model.skin.young_modulus_kpa.value = 10;
  const auto supine = [&](const SolveOptions& options) {
    Chain chain(body.scene.mesh, body.scene.anatomy, body.model, body.poses, options);
    return chain.solve(body.model).poses[0];
  };
  const PoseSolution straight = supine({.residual_tolerance = 1e-6, .progress = {}});
  ASSERT_FALSE(straight.report.turned);
  ASSERT_GT(straight.report.newton_iterations, 3);
  const PoseSolution turned = supine({.max_iterations = straight.report.newton_iterations - 1,
                                      .residual_tolerance = 1e-6,
                                      .smallest_load_step = 1,
                                      .progress = {}});
  EXPECT_TRUE(turned.report.turned);
  EXPECT_GT(turned.report.load_steps, 1);
  EXPECT_LT((turned.x - straight.x).cwiseAbs().maxCoeff(), 1e-4);
}

}  // namespace
}  // namespace supine::simulation
