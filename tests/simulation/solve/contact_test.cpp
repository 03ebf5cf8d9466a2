// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/SparseCore>

#include "simulation/laws/skin_contact_law.h"
#include "simulation/model_fields.h"
#include "simulation/solve/newton_direction.h"
#include "simulation/solve/overlap.h"
#include "simulation/solve/sensitivities.h"
#include "tests/simulation/two_blocks.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::taylor_order;

const std::vector<PoseLoad> poses = {{free_of_load, {0, 0, -1}}, {"supine", {0, 0, -1}}};

/// Two blocks imaged free of load; the upper one hangs in springs too weak to carry it and falls on the lower one.
struct Stack {
  testing::TwoBlocksScene scene;
  Model model = testing::soft_model();

  explicit Stack(const testing::TwoBlocks& blocks) : scene(testing::two_blocks_scene(blocks)) {
    scene.anatomy.imaged_pose = free_of_load;
    model.breast.young_modulus_kpa.value = 3;
    model.breast.poisson_ratio.value = 0;
    model.skin.young_modulus_kpa.value = 0;
    model.cut.stiffness_kpa_per_mm.value = 1e-4;
    model.contact.kind = ContactKind::skin;
  }
  Chain chain() const { return Chain(scene.mesh, scene.anatomy, model, poses); }
};

class ContactTest : public ::testing::TestWithParam<int> {};

// The weight of the upper block goes through a flat contact: what the lower one feels is that weight over its area.
TEST_P(ContactTest, AFlatContactTransmitsAUniformPressure) {
  // The lower block is a thin layer on stiff springs, and larger, so that the upper one has no edge to slide off or dig
  // in.
  Stack stack({.lower_mm = {60, 60, 2}, .lower_cubes = 6, .gap_mm = 3, .order = GetParam()});
  stack.model.interface.normal_kpa_per_mm.value = 100;
  Chain chain = stack.chain();
  const ChainSolution solution = chain.solve(stack.model);
  const Points &x = solution.poses[0].x, &X = solution.X;
  const double pressure = 1e-6 * gravity_mm_s2 * 20;  // of 20 mm of tissue
  const ContactFigures figures = chain.mechanics().contact()->figures({x, X});
  EXPECT_NEAR(figures.area_cm2, 32, 1.5) << "both sides of 40 mm by 40 mm";
  EXPECT_EQ(figures.overlap_mm, 0);
  const Eigen::Index upper = 18;  // faces of the upper skin, the last ones, all of it covered
  EXPECT_NEAR(figures.face_kpa.tail(upper).mean(), pressure, 0.05 * pressure);
  Sums sums(chain.mechanics().pattern());
  chain.mechanics().contact()->add({x, X}, {.residual = true}, sums);
  double carried = 0;
  for (Eigen::Index n = stack.scene.first_upper; n < x.rows(); ++n) carried -= sums.residual[3 * n + 2];
  EXPECT_NEAR(carried, pressure * 1600, 0.02 * pressure * 1600) << "the springs carry less than a hundredth";
}

// The same without contact falls through, and that is seen.
TEST_P(ContactTest, WithoutContactSkinPassesThroughSkinAndIsTold) {
  Stack stack({.lower_mm = {60, 60, 20}, .lower_cubes = 6, .gap_mm = 3, .order = GetParam()});
  stack.model.contact.kind = ContactKind::off;
  const Indices skin =
      stack.scene.mesh.faces(make_layout(stack.scene.mesh, stack.scene.anatomy).skin.faces, Eigen::all);
  Points x = stack.scene.mesh.points;
  EXPECT_EQ(find_overlap(stack.scene.mesh, skin, x).samples, 0);
  x.bottomRows(x.rows() - stack.scene.first_upper).col(2).array() -= 3 + 4.0;
  x.bottomRows(x.rows() - stack.scene.first_upper).col(0).array() += 0.37;  // off the corners of the other block
  const Overlap overlap = find_overlap(stack.scene.mesh, skin, x);
  EXPECT_GT(overlap.samples, 50);
  EXPECT_NEAR(overlap.deepest_mm, 4, 1e-9);
  const std::string warning = overlap_warning("supine", overlap, stack.model.contact);
  EXPECT_NE(warning.find("4.0 mm deep"), std::string::npos) << warning;
  EXPECT_NE(warning.find("[contact]"), std::string::npos) << warning;
  EXPECT_EQ(overlap_warning("supine", {.samples = 1, .deepest_mm = 0.9}, stack.model.contact), "");
  EXPECT_EQ(warning.find("folded"), std::string::npos) << warning;
  EXPECT_NE(overlap_warning("supine", overlap, stack.model.contact, 3).find("3 cells are folded"), std::string::npos);
}

// Through both solves and the contact between: a parameter moves the shapes as their differences say.
TEST_P(ContactTest, SensitivitiesPassThroughTheContact) {
  const Stack stack({.lower_mm = {60, 60, 20}, .lower_cubes = 6, .gap_mm = 3, .tilt_rad = 0.02, .order = GetParam()});
  Chain chain = stack.chain();
  const ChainSolution solution = chain.solve(stack.model);
  const Sensitivities sensitivities(chain, stack.model, solution);
  for (const auto& [name, step] :
       {std::pair{"breast.young_modulus_kpa", 0.02}, std::pair{"breast.density_kg_m3", 5.0}}) {
    const Points slope = sensitivities.of(name).poses[0];
    ASSERT_GT(slope.norm(), 0) << name;
    const auto moved = [&, name = name](double h) -> Points {
      Model model = stack.model;
      (std::string(name) == "breast.density_kg_m3" ? model.breast.density_kg_m3 : model.breast.young_modulus_kpa)
          .value += h;
      return h == 0 ? solution.poses[0].x : chain.solve(model, &solution).poses[0].x;
    };
    EXPECT_GT(taylor_order(moved, slope, step, 2), 1.9) << name;
    const Eigen::VectorXd gradient = sensitivities.gradient({slope}, {name});
    EXPECT_NEAR(gradient[0], slope.squaredNorm(), 1e-8 * slope.squaredNorm()) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, ContactTest, ::testing::Values(1, 2));

}  // namespace
}  // namespace supine::simulation
