// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"
#include "simulation/solve/chain.h"
#include "tests/simulation/scene.h"
#include "tests/support/shapes.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

struct Case {
  BulkLaw law;
  int order;
  SkinLaw skin;
};

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const auto& [name, law] : bulk_law_names())
    for (const int order : {1, 2})
      if (order == 1 || law != BulkLaw::corotational_qr)
        cases.push_back({law, order, cases.size() % 2 == 0 ? SkinLaw::neo_hookean : SkinLaw::corotational});
  return cases;
}

std::string case_name(const ::testing::TestParamInfo<Case>& info) {
  return name_of(info.param.law) + (info.param.order == 1 ? "_linear" : "_quadratic");
}

const Eigen::Vector3d size_mm(40, 40, 30);
const Matrix3 turn = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
const Eigen::RowVector3d shift(35, -80, 12);

testing::TestScene block(int order) {
  testing::TestScene scene = testing::box_scene(3, size_mm);
  if (order == 2) {
    scene.mesh = testing::quadratic(scene.mesh);
    scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
  }
  return scene;
}

/// Held base, elastic sides, skin on top: every term but the muscle, whose distance is a fit on a grid.
Model block_model(const Case& c) {
  Model model = testing::soft_model(c.law, c.skin);
  model.interface.kind = InterfaceKind::fixed;
  model.breast.young_modulus_kpa.value = 1;
  model.cut.stiffness_kpa_per_mm.value = 0.02;
  return model;
}

std::vector<PoseLoad> block_poses(const Matrix3& rotation) {
  return {{"prone", rotation * Eigen::Vector3d(0.3, 0.1, 0.9).normalized()},
          {"supine", rotation * Eigen::Vector3d(-0.2, 0.3, -0.9).normalized()}};
}

ChainSolution solve(const testing::TestScene& scene, const Model& model,
                    const Matrix3& rotation = Matrix3::Identity()) {
  return solve_chain(scene.mesh, scene.anatomy, model, block_poses(rotation));
}

Points turned(const Points& points) { return (points * turn.transpose()).rowwise() + shift; }

double largest(const Points& difference) { return difference.rowwise().norm().maxCoeff(); }

class ObjectivityTest : public ::testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(Laws, ObjectivityTest, ::testing::ValuesIn(all_cases()), case_name);

// Body, supports and gravity turned by 120 degrees and moved: the undeformed and the supine shape turn with them.
TEST_P(ObjectivityTest, TurnedProblemHasTheTurnedAnswer) {
  const testing::TestScene scene = block(GetParam().order);
  testing::TestScene other = scene;
  other.mesh = testing::moved(scene.mesh, turn, shift.transpose());
  other.anatomy.outward = turn * scene.anatomy.outward;
  const Model model = block_model(GetParam());
  const ChainSolution straight = solve(scene, model), rotated = solve(other, model, turn);
  EXPECT_GT(largest(straight.poses[0].x - straight.X), 1) << "hardly deformed: the test would pass for a rigid body";
  EXPECT_LT(largest(rotated.X - turned(straight.X)), 1e-9);
  EXPECT_LT(largest(rotated.poses[0].x - turned(straight.poses[0].x)), 1e-9);
}

// A rigid motion of the deformed shape alone: internal forces turn with it and the energy stays.
TEST_P(ObjectivityTest, RigidMotionOnTopTurnsTheForces) {
  const testing::TestScene scene = block(GetParam().order);
  Model model = block_model(GetParam());
  model.interface.kind = InterfaceKind::sliding;
  model.interface.normal_kpa_per_mm.value = model.interface.tangential_kpa_per_mm.value = 0;
  model.cut.stiffness_kpa_per_mm.value = 0;
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  mechanics.set_fields(values_of(
      make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, Eigen::Vector3d::Zero())));
  const Points X = scene.mesh.points;
  const Matrix3 stretch = Matrix3::Identity() + 0.2 * testing::random_matrix(3, 3, 4);
  const Points x = X * stretch.transpose() + testing::random_matrix(static_cast<int>(X.rows()), 3, 5) * 0.3;
  Sums straight(mechanics.pattern()), rotated(mechanics.pattern());
  const Demand demand{.energy = true, .residual = true};
  mechanics.evaluate({x, X}, demand, straight);
  mechanics.evaluate({turned(x), X}, demand, rotated);
  ASSERT_TRUE(straight.valid);
  EXPECT_GT(straight.residual.norm(), 1);
  EXPECT_NEAR(rotated.energy, straight.energy, 1e-11 * (1 + std::abs(straight.energy)));
  double off = 0;
  for (Eigen::Index n = 0; n < X.rows(); ++n)
    off = std::max(off, (rotated.residual.segment<3>(3 * n) - turn * straight.residual.segment<3>(3 * n)).norm());
  EXPECT_LT(off, 1e-10 * straight.residual.norm());
}

// Stiffness and weight in other units of force: nothing moves.
TEST_P(ObjectivityTest, UnitOfForceChangesNothing) {
  const testing::TestScene scene = block(GetParam().order);
  Model model = block_model(GetParam());
  const Points x = solve(scene, model).poses[0].x;
  for (const double k : {1e-3, 1e3}) {
    Model other = model;
    for (Setting* setting : {&other.breast.young_modulus_kpa, &other.breast.density_kg_m3,
                             &other.skin.young_modulus_kpa, &other.cut.stiffness_kpa_per_mm})
      setting->value *= k;
    EXPECT_LT(largest(solve(scene, other).poses[0].x - x), 1e-9) << k;
  }
}

// A body k times as large of k times the stiffness deforms into the same shape, k times as large: the weight of a
// column grows with its length. Springs per area and length keep their number, the skin's thickness grows.
TEST_P(ObjectivityTest, UnitOfLengthScalesTheAnswer) {
  const testing::TestScene scene = block(GetParam().order);
  const Model model = block_model(GetParam());
  const Points x = solve(scene, model).poses[0].x;
  for (const double k : {0.1, 10.0}) {
    testing::TestScene scaled = scene;
    scaled.mesh.points *= k;
    scaled.anatomy.mound_height_mm *= k;
    Model other = model;
    other.breast.young_modulus_kpa.value *= k;
    other.skin.young_modulus_kpa.value *= k;
    other.skin.thickness_mm.value *= k;
    EXPECT_LT(largest(solve(scaled, other).poses[0].x / k - x), 1e-7) << k;
  }
}

}  // namespace
}  // namespace supine::simulation
