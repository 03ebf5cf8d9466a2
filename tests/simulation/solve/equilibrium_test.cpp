// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>
#include <omp.h>

#include <Eigen/Geometry>

#include "common/error.h"
#include "simulation/solve/chain.h"
#include "tests/simulation/scene.h"
#include "tests/support/shapes.h"

namespace supine::simulation {
namespace {

const std::vector<PoseLoad> dome_poses = {{"prone", -Eigen::Vector3d::UnitY()}, {"supine", Eigen::Vector3d::UnitY()}};
const std::vector<PoseLoad> box_poses = {{"prone", {0.2, 0, std::sqrt(1 - 0.04)}},
                                         {"supine", -Eigen::Vector3d::UnitZ()}};

/// A box that sits on a plane muscle: the smooth distance is exact there in any frame.
struct BoxChain {
  testing::TestScene scene = testing::box_scene(3, {60, 60, 30});
  Model model = testing::soft_model();
  ChainSolution solve(const std::vector<PoseLoad>& poses = box_poses) const {
    return solve_chain(scene.mesh, scene.anatomy, model, poses);
  }
};

struct Case {
  int order;
  BulkLaw law;
  SkinLaw skin;
  double young_kpa;
};

class ChainTest : public ::testing::TestWithParam<Case> {};

TEST_P(ChainTest, RoundTripReturnsToTheImagedShape) {
  const testing::TestScene& scene = testing::dome_scene(GetParam().order);
  Model model = testing::soft_model(GetParam().law, GetParam().skin);
  model.breast.young_modulus_kpa.value = GetParam().young_kpa;
  const ChainSolution solution = solve_chain(scene.mesh, scene.anatomy, model, dome_poses);
  EXPECT_LE(solution.round_trip_max_mm, 1e-6);
  const double sag = (solution.X - scene.mesh.points).rowwise().norm().maxCoeff();
  const double turn = (solution.poses[0].x - scene.mesh.points).rowwise().norm().maxCoeff();
  EXPECT_GT(sag, 3) << "the breast hardly moved: the test would pass for a rigid body";
  EXPECT_GT(turn, sag);
  EXPECT_GT(solution.poses[0].report.min_det_f, 0);
}

INSTANTIATE_TEST_SUITE_P(All, ChainTest,
                         ::testing::Values(Case{1, BulkLaw::neo_hookean, SkinLaw::neo_hookean, 0.6},
                                           Case{1, BulkLaw::corotational, SkinLaw::corotational, 1.0},
                                           Case{1, BulkLaw::corotational_qr, SkinLaw::corotational, 1.0},
                                           Case{2, BulkLaw::neo_hookean, SkinLaw::neo_hookean, 0.8}));

TEST(Chain, RoundTripOfAStiffSkinReturnsToTheImagedShape) {
  for (const int order : {1, 2}) {
    const testing::TestScene& scene = testing::dome_scene(order);
    Model model = testing::soft_model();
    const Points limp = solve_chain(scene.mesh, scene.anatomy, model, dome_poses).poses[0].x;
    model.skin.bending_share = 300;
    const ChainSolution stiff = solve_chain(scene.mesh, scene.anatomy, model, dome_poses);
    EXPECT_LE(stiff.round_trip_max_mm, 1e-6);
    EXPECT_GT((stiff.poses[0].x - limp).rowwise().norm().maxCoeff(), 0.5);
  }
}

TEST(Chain, ReversedGravityIsNotTheInverseAndFixedPointIs) {
  const testing::TestScene& scene = testing::dome_scene();
  const Model model = testing::soft_model();
  const auto solve = [&](InverseMethod m) { return solve_chain(scene.mesh, scene.anatomy, model, dome_poses, m); };
  const ChainSolution newton = solve(InverseMethod::newton);
  const ChainSolution reversed = solve(InverseMethod::reversed_gravity);
  const ChainSolution fixed_point = solve(InverseMethod::fixed_point);
  EXPECT_GT(reversed.round_trip_max_mm, 0.1);
  EXPECT_LT(fixed_point.round_trip_max_mm, 2e-3);
  EXPECT_LT((fixed_point.X - newton.X).rowwise().norm().maxCoeff(), 0.05);
}

TEST(Chain, TurningEverythingTurnsTheAnswer) {
  BoxChain chain;
  chain.model.skin.bending_share = 100;
  const ChainSolution straight = chain.solve();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(120, -40, 15);
  BoxChain other;
  other.model = chain.model;
  other.scene.mesh = testing::moved(chain.scene.mesh, turn, shift);
  auto& anatomy = other.scene.anatomy;
  anatomy.outward = turn * anatomy.outward;
  Eigen::Matrix<double, 2, 3> reach;
  reach.row(0) = other.scene.mesh.points.colwise().minCoeff();
  reach.row(1) = other.scene.mesh.points.colwise().maxCoeff();
  anatomy.muscle = std::make_shared<meshing::MuscleDistance>(other.scene.mesh.muscle, reach);
  std::vector<PoseLoad> poses = box_poses;
  for (PoseLoad& pose : poses) pose.gravity = turn * pose.gravity;
  const ChainSolution turned = other.solve(poses);
  const Points expected = (straight.poses[0].x * turn.transpose()).rowwise() + shift.transpose();
  EXPECT_LT((turned.poses[0].x - expected).rowwise().norm().maxCoeff(), 1e-4);
}

TEST(Chain, ScaledBodyWithScaledStiffnessGivesTheScaledAnswer) {
  BoxChain small, large;
  small.model.skin.bending_share = large.model.skin.bending_share = 100;
  const double k = 2;
  large.scene = testing::box_scene(3, {60 * k, 60 * k, 30 * k});
  large.model.breast.young_modulus_kpa.value *= k;
  large.model.skin.young_modulus_kpa.value *= k;
  large.model.skin.thickness_mm.value *= k;
  const Points a = small.solve().poses[0].x, b = large.solve().poses[0].x;
  EXPECT_LT((k * a - b).rowwise().norm().maxCoeff(), 1e-4);
}

TEST(Chain, ThreadsDoNotChangeABit) {
  const testing::TestScene& scene = testing::dome_scene();
  const Model model = testing::soft_model();
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const Points one = solve_chain(scene.mesh, scene.anatomy, model, dome_poses).poses[0].x;
  omp_set_num_threads(2);
  const Points two = solve_chain(scene.mesh, scene.anatomy, model, dome_poses).poses[0].x;
  omp_set_num_threads(before);
  EXPECT_EQ(one, two);
}

TEST(Chain, HeldInterfaceStaysPut) {
  BoxChain chain;
  chain.model.interface.kind = InterfaceKind::fixed;
  const ChainSolution solution = chain.solve();
  const auto& mesh = chain.scene.mesh;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    if (mesh.region[f] == static_cast<int>(reconstruction::Region::inner))
      for (const int n : mesh.faces.row(f)) {
        EXPECT_EQ(solution.X.row(n), mesh.points.row(n));
        EXPECT_EQ(solution.poses[0].x.row(n), mesh.points.row(n));
      }
}

TEST(Chain, SlidingInterfaceMovesBetweenUndeformedAndProne) {
  const BoxChain chain;
  const ChainSolution solution = chain.solve();
  double largest = 0;
  for (const int face : make_layout(chain.scene.mesh, chain.scene.anatomy).interface.faces)
    for (const int n : chain.scene.mesh.faces.row(face))
      largest = std::max(largest, (solution.X.row(n) - chain.scene.mesh.points.row(n)).norm());
  EXPECT_GT(largest, 0.05) << "springs must be force-free in the undeformed shape, not in the imaged one";
}

TEST(Chain, TooSoftATissueIsRefusedWithTheLoadReached) {
  const testing::TestScene& scene = testing::dome_scene();
  Model model = testing::soft_model(BulkLaw::corotational, SkinLaw::corotational);
  model.breast.young_modulus_kpa.value = 0.03;
  model.skin.young_modulus_kpa.value = 0.1;
  try {
    solve_chain(scene.mesh, scene.anatomy, model, dome_poses);
    FAIL() << "no equilibrium was expected";
  } catch (const NumericalFailure& failure) {
    const std::string message = failure.what();
    EXPECT_NE(message.find("% of gravity"), std::string::npos) << message;
    EXPECT_NE(message.find("breast.young_modulus_kpa"), std::string::npos) << message;
  }
}

SolveReport forward_box(const SolveOptions& options) {
  const BoxChain box;
  Chain chain(box.scene.mesh, box.scene.anatomy, box.model, box_poses, options);
  return chain.solve(box.model).poses[0].report;
}

TEST(Equilibrium, SaysWhichBoundEndedTheSolve) {
  const SolveReport by_residual = forward_box({.step_tolerance_mm = 0, .residual_tolerance = 1e-6, .progress = {}});
  EXPECT_EQ(by_residual.termination, Termination::residual_small);
  EXPECT_LE(by_residual.residual_share, 1e-6);
  const SolveReport by_step = forward_box({.step_tolerance_mm = 1e-3, .residual_tolerance = 0, .progress = {}});
  EXPECT_EQ(by_step.termination, Termination::step_small);
  EXPECT_LE(by_step.residual_share, loosest_residual_share);
}

TEST(Equilibrium, TooFewIterationsAreNamed) {
  try {
    forward_box({.max_iterations = 1, .smallest_load_step = 1, .progress = {}});
    FAIL() << "one Newton step was enough";
  } catch (const NumericalFailure& failure) {
    const std::string message = failure.what();
    EXPECT_NE(message.find("beyond 0 % of gravity (no convergence in 1 iterations"), std::string::npos) << message;
  }
}

TEST(Equilibrium, AStepThatIsArrivingIsFollowedByTheNextWhateverTheLimit) {
  const SolveReport free = forward_box({.progress = {}});
  const SolveReport short_of_one =
      forward_box({.max_iterations = free.newton_iterations - 1, .smallest_load_step = 1, .progress = {}});
  EXPECT_EQ(short_of_one.newton_iterations, free.newton_iterations);
}

TEST(Equilibrium, AStepThatIsArrivingIsFollowedByTheNextWhateverWorkIsLeft) {
  constexpr int step_and_factor = 5;
  const testing::TestScene& scene = testing::dome_scene(2);
  const Model model = testing::soft_model();
  const Chain chain(scene.mesh, scene.anatomy, model, dome_poses);
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  mechanics.set_fields(values_of(chain.fields(model, dome_poses[1])));
  const auto work_within = [&](int most) {
    EquilibriumSolver solver(mechanics, {.most_work = most, .smallest_load_step = 1, .progress = {}});
    Points x;
    solver.forward(scene.mesh.points, x, "lying");
    return solver.work();
  };
  const int needed = work_within(SolveOptions().most_work);
  EXPECT_EQ(work_within(needed - step_and_factor), needed);
}

TEST(Equilibrium, ABodyThatSlidesOffIsGivenUpAndSaidTo) {
  const testing::TestScene& scene = testing::dome_scene(2);
  Model soft = testing::soft_model();
  soft.breast.young_modulus_kpa.value = 0.1;
  soft.skin.young_modulus_kpa.value = 1;
  const Chain chain(scene.mesh, scene.anatomy, soft, dome_poses);
  Mechanics mechanics(scene.mesh, scene.anatomy, soft);
  mechanics.set_fields(values_of(chain.fields(soft, dome_poses[1])));
  EquilibriumSolver solver(mechanics, {.smallest_load_step = 1, .progress = {}});
  Points x;
  try {
    solver.forward(scene.mesh.points, x, "lying");
    FAIL() << "this body is carried";
  } catch (const NoEquilibrium& failure) {
    EXPECT_NE(std::string(failure.what()).find("slides off"), std::string::npos) << failure.what();
  }
}

TEST(Equilibrium, WorkThatCostsTooMuchIsGivenUp) {
  try {
    forward_box({.most_work = 1, .progress = {}});
    FAIL() << "one Newton step was enough";
  } catch (const NoEquilibrium& failure) {
    EXPECT_NE(std::string(failure.what()).find("given up"), std::string::npos) << failure.what();
  }
}

TEST(Chain, GivesUpWhereItsWorkIsLimitedAndOnlyThere) {
  const BoxChain box;
  Chain chain(box.scene.mesh, box.scene.anatomy, box.model, box_poses);
  const ChainSolution free = chain.solve(box.model);
  EXPECT_GT(free.dearest_solve, std::max(free.inverse.newton_iterations, free.poses[0].report.newton_iterations));
  chain.limit_each_solve(free.dearest_solve + 1);
  EXPECT_EQ(chain.solve(box.model).poses[0].x, free.poses[0].x);
  chain.limit_each_solve(free.dearest_solve / 2);
  EXPECT_THROW(chain.solve(box.model), NoEquilibrium);
  chain.limit_each_solve({});
  EXPECT_EQ(chain.solve(box.model).poses[0].x, free.poses[0].x);
}

TEST(Chain, WorkCountsTheCyclesOfMultigridBesideStepsAndFactors) {
  const auto beside = [](int order) {
    const testing::TestScene& scene = testing::dome_scene(order);
    const ChainSolution solution = solve_chain(scene.mesh, scene.anatomy, testing::soft_model(), dome_poses);
    int counted = 0;
    for (const SolveReport& report : {solution.inverse, solution.poses[0].report})
      counted = std::max(counted, report.newton_iterations + work_of_factor * report.factorisations);
    return solution.dearest_solve - counted;
  };
  EXPECT_EQ(beside(1), 0);
  EXPECT_GT(beside(2), 0);
}

TEST(Chain, ProneGravityIntoTheMuscleIsRefused) {
  const BoxChain chain;
  EXPECT_THROW(chain.solve({{"prone", -Eigen::Vector3d::UnitZ()}, {"supine", Eigen::Vector3d::UnitZ()}}), InputError);
}

TEST(Chain, TheOrderOfEffectsInTheModelChangesNothing) {
  const testing::TestScene& scene = testing::dome_scene();
  const EffectSetting ligament{"ligament", {{"stiffness_kpa_per_mm", Setting{0.4}}}, {}};
  const EffectSetting adhesion{"adhesion", {{"log_factor", Setting{2}}}, {}};
  Model one = testing::soft_model(), other = one;
  one.effects = {ligament, adhesion};
  other.effects = {adhesion, ligament};
  EXPECT_EQ(solve_chain(scene.mesh, scene.anatomy, one, dome_poses).poses[0].x,
            solve_chain(scene.mesh, scene.anatomy, other, dome_poses).poses[0].x);
}

TEST(Chain, RigidLigamentHoldsItsRing) {
  const testing::TestScene& scene = testing::dome_scene();
  Model model = testing::soft_model();
  model.effects = {{"ligament", {}, {{"tie", "rigid"}}}};
  const ChainSolution solution = solve_chain(scene.mesh, scene.anatomy, model, dome_poses);
  EXPECT_LE(solution.round_trip_max_mm, 1e-6);
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  double ring = 0, inside = 0;  // largest way from undeformed to supine
  for (const int face : layout.interface.faces)
    for (const int n : scene.mesh.faces.row(face)) {
      const double moved = (solution.poses[0].x.row(n) - solution.X.row(n)).norm();
      const double from_foot = scene.anatomy.from_foot_mm(scene.anatomy.q.row(n).transpose());
      if (std::abs(from_foot) < 2) ring = std::max(ring, moved);
      if (from_foot < -25) inside = std::max(inside, moved);
    }
  EXPECT_LT(ring, 1e-3);
  EXPECT_GT(inside, 0.1);
}

TEST(Chain, EffectsThatCannotActAreRefused) {
  const testing::TestScene& scene = testing::dome_scene();
  const auto expect_refused = [&scene](const Model& model, const char* word) {
    try {
      solve_chain(scene.mesh, scene.anatomy, model, dome_poses);
      FAIL() << "accepted: " << model.effects[0].name;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(model.effects[0].name), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  Model model = testing::soft_model(BulkLaw::corotational, SkinLaw::corotational);
  model.effects = {{"strain_stiffening", {}, {}}};
  expect_refused(model, "neo_hookean");
  model = testing::soft_model();
  model.effects = {{"tumour_stiffness", {}, {}}};
  expect_refused(model, "no tissue of its kind");
  model.effects = {{"adhesion", {}, {}}};
  model.interface.kind = InterfaceKind::fixed;
  expect_refused(model, "fixed");
}

TEST(Chain, QrNeedsLinearCells) {
  const testing::TestScene& scene = testing::dome_scene(2);
  EXPECT_THROW(solve_chain(scene.mesh, scene.anatomy, testing::soft_model(BulkLaw::corotational_qr), dome_poses),
               InputError);
}

}  // namespace
}  // namespace supine::simulation
