// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/carrying_modulus.h"

#include <gtest/gtest.h>

#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

const std::vector<PoseLoad> poses = {{"prone", {0, -1, 0}}, {"supine", {0, 1, 0}}};

/// Far too soft for its weight, of a law that does not stiffen in compression, and with little skin to hold it.
Model too_soft() {
  Model model = testing::soft_model(BulkLaw::corotational);
  model.breast.young_modulus_kpa.value = 0.02;
  model.skin.young_modulus_kpa.value = 0.2;
  return model;
}

/// Whether a chain of full effort finds every pose.
bool carries(const testing::TestScene& scene, Model model, double kpa) {
  model.breast.young_modulus_kpa.value = kpa;
  try {
    Chain(scene.mesh, scene.anatomy, model, poses).solve(model);
    return true;
  } catch (const NumericalFailure&) {
    return false;
  }
}

TEST(CarryingModulus, LiesBetweenWhatCarriesAndWhatDoesNot) {
  const testing::TestScene& scene = testing::dome_scene();
  const Model model = too_soft();
  const ModulusSearch search{.ratio = 1.05, .softest_kpa = 0.001};
  const CarryingModulus found = find_carrying_modulus(scene.mesh, scene.anatomy, model, poses, search);
  ASSERT_TRUE(found.fails_kpa);
  EXPECT_GT(found.carries_kpa, *found.fails_kpa);
  EXPECT_LE(found.carries_kpa, search.ratio * *found.fails_kpa);
  EXPECT_TRUE(carries(scene, model, 1.02 * found.carries_kpa));
  EXPECT_FALSE(carries(scene, model, 0.8 * *found.fails_kpa));
}

TEST(CarryingModulus, EndsWhereNothingSofterIsWanted) {
  const testing::TestScene& scene = testing::dome_scene();
  Model model = testing::soft_model();
  const CarryingModulus found = find_carrying_modulus(scene.mesh, scene.anatomy, model, poses,
                                                      {.softest_kpa = 0.9 * model.breast.young_modulus_kpa.value});
  EXPECT_FALSE(found.fails_kpa);
  EXPECT_EQ(found.carries_kpa, 0.9 * model.breast.young_modulus_kpa.value);
  EXPECT_EQ(found.chains, 2);
}

TEST(CarryingModulus, ABodyThatNothingCarriesIsSaidSo) {
  const testing::TestScene& scene = testing::dome_scene();
  EXPECT_THROW(find_carrying_modulus(scene.mesh, scene.anatomy, too_soft(), poses, {.stiffest_kpa = 0.02}),
               NumericalFailure);
}

TEST(CarryingModulus, AFailureNamesAModulusAndHowFarItCame) {
  const testing::TestScene& scene = testing::dome_scene();
  const Model model = too_soft();
  try {
    Chain(scene.mesh, scene.anatomy, model, poses).solve(model);
    FAIL() << "carried";
  } catch (const NoEquilibrium& failure) {
    EXPECT_GT(failure.load(), 0);
    EXPECT_LT(failure.load(), 1);
    const std::string message = failure.what();
    EXPECT_NE(message.find("would carry it (0.02 carried"), std::string::npos) << message;
    EXPECT_NE(message.find("--find-modulus"), std::string::npos) << message;
  }
}

TEST(CarryingModulus, AFailureNamesWhatTheModelDoesNotHaveYet) {
  const testing::TestScene& scene = testing::dome_scene();
  SolveOptions given_up;
  given_up.most_work = 20;
  const auto said = [&scene, &given_up](const Model& model) -> std::string {
    try {
      Chain(scene.mesh, scene.anatomy, model, poses, given_up).solve(model);
    } catch (const NoEquilibrium& failure) {
      return failure.what();
    }
    return "carried";
  };
  Model model = too_soft();
  const std::string without = said(model);
  for (const char* advice : {"skin.bending_share = 3 lets", "breast.law = \"neo_hookean\""})
    EXPECT_NE(without.find(advice), std::string::npos) << without;
  model.breast.law = BulkLaw::neo_hookean;
  model.breast.young_modulus_kpa.value = 0.001;
  model.skin.young_modulus_kpa.value = 0.01;
  model.skin.bending_share = 0.1;
  const std::string with = said(model);
  for (const char* advice : {"bending_share", "breast.law"}) EXPECT_EQ(with.find(advice), std::string::npos) << with;
  EXPECT_NE(with.find("no equilibrium found beyond"), std::string::npos) << with;
}

TEST(Volume, OfTheDomeIsThatOfItsCellsWhateverTheOrder) {
  const testing::TestScene& linear = testing::dome_scene(1);
  const meshing::TetMesh quadratic = testing::quadratic(linear.mesh);
  const double volume = volume_mm3(linear.mesh.cells, linear.mesh.points);
  EXPECT_GT(volume, 0);
  EXPECT_NEAR(volume_mm3(quadratic.cells, quadratic.points), volume, 1e-12 * volume);
  EXPECT_NEAR(volume_mm3(linear.mesh.cells, 2 * linear.mesh.points), 8 * volume, 1e-12 * volume);
}

}  // namespace
}  // namespace supine::simulation
