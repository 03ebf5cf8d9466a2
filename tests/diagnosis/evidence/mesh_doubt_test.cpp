// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/mesh_doubt.h"

#include <gtest/gtest.h>

#include <cmath>

namespace supine::diagnosis {
namespace {

/// Posterior of a number with a normal prior that was measured once.
Known measured(const Known& believed, double at, double error) {
  const double before = 1 / (believed.sd * believed.sd), by_measurement = 1 / (error * error);
  return {(believed.mean * before + at * by_measurement) / (before + by_measurement),
          1 / std::sqrt(before + by_measurement)};
}

TEST(MeshDoubt, IsAnErrorOfTheMeasurementMore) {
  const Known believed{0.4, 2};
  for (const double error : {0.1, 1.0, 30.0})
    for (const double doubt : {0.0, 0.6, 5.0}) {
      const Known known = with_doubt(measured(believed, 3, error), believed, doubt);
      const Known wanted = measured(believed, 3, std::hypot(error, doubt));
      EXPECT_NEAR(known.mean, wanted.mean, 1e-9);
      EXPECT_NEAR(known.sd, wanted.sd, 1e-9);
    }
}

TEST(MeshDoubt, NeverSaysLessThanWasBelieved) {
  const Known believed{0, 0.3};
  const Known unmeasured = with_doubt(believed, believed, 0.6);
  EXPECT_EQ(unmeasured.mean, believed.mean);
  EXPECT_EQ(unmeasured.sd, believed.sd);
  EXPECT_LT(with_doubt({0.2, 0.1}, believed, 0.6).sd, believed.sd);
}

TEST(Mixed, IsAsWideAsWhatIsMixedAndWhatLiesBetween) {
  const Known one = mixed({{0.3, {2, 0.5}}});
  EXPECT_DOUBLE_EQ(one.mean, 2);
  EXPECT_NEAR(one.sd, 0.5, 1e-12);
  const Known two = mixed({{0.6, {1, 0.5}}, {0.2, {5, 1}}});  // 3 to 1
  EXPECT_NEAR(two.mean, 2, 1e-12);
  EXPECT_NEAR(two.sd, std::sqrt(0.75 * 0.25 + 0.25 * 1 + 0.75 * 1 + 0.25 * 9), 1e-12);
}

TEST(MeshDoubt, IsOfModuliAndPlacesAlone) {
  for (const char* modulus : {"breast.young_modulus_kpa", "skin.young_modulus_kpa"})
    EXPECT_DOUBLE_EQ(mesh_doubt(modulus), 0.15);
  EXPECT_DOUBLE_EQ(mesh_doubt("misregistration.shift_y_mm"), 0.6);
  EXPECT_NEAR(mesh_doubt("misregistration.turn_z_rad"), 0.35 * 3.14159265 / 180, 1e-8);
  for (const char* other : {"breast.poisson_ratio", "ligament.stiffness_kpa_per_mm", "gravity_tilt.roll_rad", ""})
    EXPECT_EQ(mesh_doubt(other), 0) << other;
}

}  // namespace
}  // namespace supine::diagnosis
