// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstring>

#include "common/error.h"
#include "simulation/model_fields.h"
#include "simulation/parameters.h"
#include "simulation/solve/chain.h"
#include "tests/simulation/effects/effect_scene.h"

// What the effects do to the shapes of a patient.
namespace supine::simulation {
namespace {

using testing::effect, testing::mixed_box, testing::part;

const std::vector<PoseLoad> box_poses = {{"prone", {0.2, 0, std::sqrt(1 - 0.04)}},
                                         {"supine", -Eigen::Vector3d::UnitZ()}};

bool same_bytes(const Points& a, const Points& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), sizeof(double) * a.size()) == 0;
}

class NullEffectTest : public ::testing::TestWithParam<const Effect*> {};

TEST_P(NullEffectTest, LeavesTheWholeChainByteForByte) {
  testing::TestScene scene = mixed_box(4);
  if (GetParam()->name() == "left_right_stiffness") part(scene);
  Model without = testing::soft_model();
  if (GetParam()->name() == "support_compliance") without.interface.kind = InterfaceKind::elastic;
  Model with = without;
  with.effects = {null_setting(*GetParam())};
  if (!GetParam()->belongs_to(scene.mesh, scene.anatomy, with)) {  // of objects
    EXPECT_THROW(solve_chain(scene.mesh, scene.anatomy, with, box_poses), InputError);
    return;
  }
  const ChainSolution a = solve_chain(scene.mesh, scene.anatomy, without, box_poses);
  const ChainSolution b = solve_chain(scene.mesh, scene.anatomy, with, box_poses);
  EXPECT_TRUE(same_bytes(a.X, b.X));
  EXPECT_TRUE(same_bytes(a.poses[0].x, b.poses[0].x));
  EXPECT_TRUE(same_bytes(a.round_trip.x, b.round_trip.x));
}

INSTANTIATE_TEST_SUITE_P(Effects, NullEffectTest, ::testing::ValuesIn(catalogue()),
                         [](const auto& place) { return place.param->name(); });

TEST(Friction, HoldsTheBreastBackAndTheRoundTripStillCloses) {
  const testing::TestScene& scene = testing::dome_scene();
  const std::vector<PoseLoad> poses = {{"prone", -Eigen::Vector3d::UnitY()}, {"supine", Eigen::Vector3d(0.6, 0.8, 0)}};
  const auto slid = [&](double coefficient) {
    Model model = testing::soft_model();
    model.effects = {effect("friction", {{"coefficient", coefficient}})};
    const ChainSolution solution = solve_chain(scene.mesh, scene.anatomy, model, poses);
    EXPECT_LE(solution.round_trip_max_mm, 1e-6);
    const Layout layout = make_layout(scene.mesh, scene.anatomy);
    double sum = 0;
    for (const int face : layout.interface.faces)
      for (const int n : scene.mesh.faces.row(face)) sum += (solution.poses[0].x - solution.X).row(n).norm();
    return sum;
  };
  const double free = slid(0), little = slid(0.1), much = slid(0.5);
  EXPECT_LT(little, 0.98 * free);
  EXPECT_LT(much, 0.95 * little);
}

TEST(ArmTraction, PullsOnTheUpperOuterSkinInEveryPoseButProne) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect("arm_traction", {{"lateral_kpa", 0.4}, {"head_kpa", 0.2}})};
  const auto at = [&](const char* pose) {
    return values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, pose}, {0, 1, 0})).skin_traction;
  };
  EXPECT_EQ(at("prone").norm(), 0);
  const Eigen::VectorXd traction = at("supine");
  const Eigen::Vector3d along = 0.4 * scene.anatomy.lateral + 0.2 * scene.anatomy.head;
  double largest = 0;
  for (Eigen::Index f = 0; f < layout.skin.faces.size(); ++f) {
    const Eigen::Vector3d t = traction.segment<3>(3 * f);
    EXPECT_LT(t.cross(along).norm(), 1e-12);
    if (layout.skin.q(f, 0) < 0.1 || layout.skin.q(f, 1) < 0.1) {
      EXPECT_EQ(t.norm(), 0);
    }
    largest = std::max(largest, t.norm() / along.norm());
  }
  EXPECT_GT(largest, 0.6);
  EXPECT_LE(largest, 1);
}

TEST(ArmTraction, TheMiddleOfThePatchIsWhereTheModelSays) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect("arm_traction", {{"head_kpa", 0.2}, {"centre_lateral", 0.9}, {"radius", 0.3}})};
  const Eigen::VectorXd traction =
      values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "supine"}, {0, 1, 0})).skin_traction;
  double felt = 0;
  for (Eigen::Index f = 0; f < layout.skin.faces.size(); ++f) {
    const double r = (layout.skin.q.row(f) - Eigen::RowVector2d(0.9, 0.65)).norm() / 0.3;
    EXPECT_NEAR(traction.segment<3>(3 * f).norm(), r < 1 ? 0.2 * std::pow(1 - r * r, 3) : 0, 1e-12);
    felt += r < 1;
  }
  EXPECT_GT(felt, 0);
}

TEST(ChestWallMotion, TheHillStandsAndEndsWhereTheModelSays) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect("chest_wall_motion", {{"amplitude_mm", 4}, {"centre_head", -0.4}, {"radius", 0.7}})};
  const Eigen::VectorXd offset =
      values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "supine"}, {0, 1, 0})).muscle_offset;
  for (Eigen::Index p = 0; p < layout.interface.q.rows(); ++p) {
    const double r = (layout.interface.q.row(p) - Eigen::RowVector2d(0, -0.4)).norm() / 0.7;
    EXPECT_NEAR(offset[p], r < 1 ? 4 * std::pow(1 - r * r, 3) : 0, 1e-12);
  }
  EXPECT_GT(offset.maxCoeff(), 3);
}

TEST(ChestWallMotion, MovesTheInnerSurfaceOutButNotInProne) {
  const testing::TestScene& scene = testing::dome_scene();
  const std::vector<PoseLoad> poses = {{"prone", -Eigen::Vector3d::UnitY()}, {"supine", Eigen::Vector3d::UnitY()}};
  Model model = testing::soft_model();
  const ChainSolution still = solve_chain(scene.mesh, scene.anatomy, model, poses);
  model.effects = {effect("chest_wall_motion", {{"amplitude_mm", 6}})};
  const ChainSolution out = solve_chain(scene.mesh, scene.anatomy, model, poses);
  EXPECT_TRUE(same_bytes(still.X, out.X));
  double highest = 0;
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  for (const int face : layout.interface.faces)
    for (const int n : scene.mesh.faces.row(face)) {
      const auto height = [&](const Points& x) { return scene.anatomy.muscle->value(x.row(n).transpose()); };
      const double rise = height(out.poses[0].x) - height(still.poses[0].x);
      if (scene.anatomy.q.row(n).norm() > 1.3) {
        EXPECT_LT(std::abs(rise), 0.6);
      }
      highest = std::max(highest, rise);
    }
  EXPECT_GT(highest, 5);
  EXPECT_LT(highest, 6.5);
}

TEST(Creep, SoftensProneAlone) {
  const testing::TestScene scene = mixed_box(2);
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect("creep", {{"log_softening", 0.3}})};
  const auto modulus = [&](const char* pose) {
    return std::exp(values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, pose}, {0, 1, 0})).ln_young[0]);
  };
  EXPECT_NEAR(modulus("supine"), 0.8, 1e-12);
  EXPECT_NEAR(modulus("prone") / modulus("supine"), std::exp(-0.3), 1e-12);
}

TEST(Misregistration, MovesTheScanAndNoShape) {
  const testing::TestScene scene = mixed_box(4);
  const Model without = testing::soft_model();
  Model with = without;
  with.effects = {effect("misregistration", {{"shift_x_mm", 4}, {"turn_z_rad", -0.1}})};
  const ChainSolution a = solve_chain(scene.mesh, scene.anatomy, without, box_poses);
  const ChainSolution b = solve_chain(scene.mesh, scene.anatomy, with, box_poses);
  EXPECT_TRUE(same_bytes(a.poses[0].x, b.poses[0].x));
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const auto motion = [&](const char* pose) {
    return values_of(make_fields(with, {scene.mesh, scene.anatomy, layout, pose}, {0, 1, 0})).scan_motion.eval();
  };
  Eigen::VectorXd expected(6);
  expected << 4, 0, 0, 0, 0, -0.1;
  EXPECT_EQ(motion("supine"), expected);
  EXPECT_EQ(motion("prone").norm(), 0);
}

}  // namespace
}  // namespace supine::simulation
