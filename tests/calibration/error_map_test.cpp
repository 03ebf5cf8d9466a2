// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/error_map.h"

#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkXMLImageDataReader.h>

#include <cmath>

#include "common/error.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::calibration {
namespace {

/// Moduli, 0.1 to 10 kPa, and an amplitude of either sign; each result tells where it is; one has no equilibrium.
ErrorMap small_map() {
  ErrorMap map{"breast.young_modulus_kpa", "chest_wall_motion.amplitude_mm", {0.1, 1, 10}, {-4, -1}, {}};
  for (int i = 0; i < 6; ++i) map.results.push_back({i == 4, 1.0 + i, 2.0 + i, 3.0 + i});
  return map;
}

TEST(ErrorMap, PointsOfItsImageLieOverLogarithmsOfTheValues) {
  const pipeline::TemporaryFolder folder;
  const ErrorMap map = small_map();
  write_map_vti(map, folder / "map.vti");
  vtkNew<vtkXMLImageDataReader> reader;
  reader->SetFileName((folder / "map.vti").c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  ASSERT_EQ(image->GetNumberOfPoints(), 6);
  const double log_x[3] = {-1, 0, 1}, y[2] = {-4, -1};
  for (int i = 0; i < 6; ++i) {
    const double* at = image->GetPoint(i);
    EXPECT_NEAR(at[0], log_x[i % 3], 1e-12) << i;
    EXPECT_NEAR(at[1], y[i / 3], 1e-12) << i;
    const double mae = image->GetPointData()->GetArray("mae_study_mm")->GetTuple1(i);
    const double rms = image->GetPointData()->GetArray("rms_mm")->GetTuple1(i);
    EXPECT_EQ(std::isnan(mae), i == 4);
    EXPECT_EQ(std::isnan(rms), i == 4);
    if (i == 4) continue;
    EXPECT_EQ(mae, 1.0 + i);
    EXPECT_EQ(rms, 3.0 + i);
  }
}

TEST(ErrorMap, LinesOfItsTableHoldTheValuesThemselves) {
  const pipeline::TemporaryFolder folder;
  write_map_csv(small_map(), folder / "map.csv");
  EXPECT_EQ(pipeline::read_text(folder / "map.csv"),
            "breast.young_modulus_kpa,chest_wall_motion.amplitude_mm,mae_study_mm,mae_mm,rms_mm,failed\n"
            "0.1,-4,1,2,3,0\n1,-4,2,3,4,0\n10,-4,3,4,5,0\n0.1,-1,4,5,6,0\n1,-1,,,,1\n10,-1,6,7,8,0\n");
  EXPECT_THROW(write_map_csv(small_map(), folder / "none" / "map.csv"), InputError);
  EXPECT_THROW(write_map_vti(small_map(), folder / "none" / "map.vti"), InputError);
}

}  // namespace
}  // namespace supine::calibration
