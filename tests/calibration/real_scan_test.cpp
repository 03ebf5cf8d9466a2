// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <filesystem>

#include "calibration/compare.h"
#include "common/error.h"
#include "reconstruction/surface_io.h"

namespace supine::calibration {
namespace {

class HiddenOpen : public ::testing::Test {
 protected:
  const std::filesystem::path folder = std::filesystem::path(SUPINE_SHARED_DATA) / "hidden-open" / "null-1";

  void SetUp() override {
    if (!std::filesystem::exists(folder / "supine.ply")) GTEST_SKIP() << folder << " is not there";
    supine = reconstruction::read_surface(folder / "supine.ply");
  }

  reconstruction::Surface supine;
};

}  // namespace

TEST_F(HiddenOpen, ScanAgainstItselfIsZero) {
  const ModelSkin model(supine.points, supine.triangles);
  const Scan scan(supine, model);
  check_placement(scan, model, {}, "supine.ply");
  const Comparison result = compare(model, scan, {});
  EXPECT_EQ(scan.distance().triangles().rows(), 8325);
  EXPECT_LT(result.scan.hausdorff_mm, 1e-12);
  EXPECT_LT(result.mae_study_mm, 1e-12);
  // All but the points of its borders, of which the holes have a few.
  EXPECT_GT(result.covered_fraction, 0.9);
  EXPECT_EQ(result.scan_points_used, result.model_to_scan.covered.count());
}

TEST_F(HiddenOpen, BarePointsOfTheScanLieOnItWithinItsNoise) {
  const ModelSkin model(supine.points, supine.triangles);
  const Scan cloud({supine.points, Triangles(0, 3), {}}, model);
  const Comparison result = compare(model, cloud, {});
  EXPECT_LT(result.mae_study_mm, 0.7);
  EXPECT_GT(result.covered_fraction, 0.9);
}

TEST_F(HiddenOpen, ScanWrittenAsRasIsRefused) {
  const ModelSkin model(supine.points, supine.triangles);
  auto ras = supine;
  ras.points.leftCols(2) *= -1;
  EXPECT_THROW(check_placement(Scan(ras, model), model, {}), InputError);
}

}  // namespace supine::calibration
