// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/numerical_error.h"

#include <gtest/gtest.h>

#include "calibration/free_parameters.h"
#include "common/error.h"
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

TEST(NumericalError, IsWhatTwoOtherMeshesChange) {
  const Fitted f;
  const NumericalError error = measure_numerical_error(f.twin.scene(), twin_truth(), f.fit);
  EXPECT_TRUE(error.failed.empty());
  EXPECT_GT(error.spread_mm, 0);
  EXPECT_NEAR(error.spread_mm * error.spread_mm * static_cast<double>(f.fit.residuals.size()),
              error.finer_mm.squaredNorm() + error.coarser_mm.squaredNorm(), 1e-9);
}

TEST(NumericalError, SaysWhyNeitherMeshGaveAnAnswer) {
  const Fitted f;
  meshing::TetMesh crossed = f.twin.mesh;  // its nipple pulled through its muscle: no surface to fill anew
  crossed.points.row(f.twin.anatomy.nipple_point) -= 200 * f.twin.anatomy.outward.transpose();
  calibration::Scene scene = f.twin.scene();
  scene.mesh = &crossed;
  try {
    measure_numerical_error(scene, twin_truth(), f.fit);
    FAIL() << "measured";
  } catch (const NumericalFailure& error) {
    for (const char* word : {"the error of the mesh cannot be measured", "finer mesh: ", "coarser mesh: "})
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace supine::diagnosis
