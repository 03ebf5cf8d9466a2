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

TEST(MeshDoubt, IsOfModuliAndPlacesAlone) {
  EXPECT_DOUBLE_EQ(mesh_doubt("breast.young_modulus_kpa"), mesh_doubt("skin.young_modulus_kpa"));
  EXPECT_GT(mesh_doubt("misregistration.shift_y_mm"), 0.1);
  EXPECT_NEAR(mesh_doubt("misregistration.turn_z_rad"), 0.006, 0.001);
  for (const char* other : {"breast.poisson_ratio", "ligament.stiffness_kpa_per_mm", "gravity_tilt.roll_rad", ""})
    EXPECT_EQ(mesh_doubt(other), 0) << other;
}

}  // namespace
}  // namespace supine::diagnosis
