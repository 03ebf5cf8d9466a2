// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/comparison_files.h"

#include <gtest/gtest.h>
#include <omp.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include <fstream>
#include <sstream>

#include "common/error.h"
#include "tests/calibration/shapes.h"

namespace supine::calibration {
namespace {

std::filesystem::path temporary(const std::string& name) {
  return std::filesystem::path(::testing::TempDir()) / ("comparison_files_" + name);
}

std::string bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return (std::stringstream() << stream.rdbuf()).str();
}

vtkNew<vtkXMLPolyDataReader> read(const std::filesystem::path& file) {
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  return reader;
}

struct Case {
  reconstruction::Surface surface = testing::sheet(0, 40, 4);
  ModelSkin model{surface.points, surface.triangles};
  Scan scan{testing::sheet(-10, 50, 12, [](double, double) { return 2.0; }), model};
  SkinAreas areas{{"near", "far"}, Eigen::VectorXi::Zero(25)};
  Case() { areas.of_point.tail(5).setOnes(); }
};

}  // namespace

TEST(ComparisonFiles, SkinCarriesDistanceCoverAndArea) {
  const Case given;
  const auto file = temporary("skin.vtp");
  write_comparison(compare(given.model, given.scan, given.areas), given.model, given.areas, file);
  const auto reader = read(file);
  auto* points = reader->GetOutput()->GetPointData();
  EXPECT_EQ(reader->GetOutput()->GetNumberOfPoints(), 25);
  EXPECT_EQ(reader->GetOutput()->GetNumberOfPolys(), 32);
  EXPECT_NEAR(points->GetArray("distance_mm")->GetTuple1(12), 2, 1e-12);
  EXPECT_EQ(points->GetArray("covered")->GetTuple1(0), 1);
  auto* names = vtkStringArray::SafeDownCast(points->GetAbstractArray("area_name"));
  ASSERT_NE(names, nullptr);
  EXPECT_EQ(names->GetValue(0), "near");
  EXPECT_EQ(names->GetValue(24), "far");
  auto* frame = vtkStringArray::SafeDownCast(reader->GetOutput()->GetFieldData()->GetAbstractArray("frame"));
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->GetValue(0), "LPS");
}

TEST(ComparisonFiles, ScanCarriesDistanceAndUse) {
  const Case given;
  const auto file = temporary("scan.vtp");
  write_scan(compare(given.model, given.scan, {}), given.scan, file);
  const auto reader = read(file);
  auto* points = reader->GetOutput()->GetPointData();
  EXPECT_EQ(reader->GetOutput()->GetNumberOfPolys(), 288);
  EXPECT_EQ(points->GetArray("used")->GetTuple1(0), 0);
  EXPECT_EQ(points->GetArray("used")->GetTuple1(84), 1);
  EXPECT_NEAR(points->GetArray("distance_mm")->GetTuple1(84), 2, 1e-12);
}

TEST(ComparisonFiles, BarePointsAreWrittenAsVertices) {
  const Case given;
  const Scan cloud({given.scan.points(), Triangles(0, 3), {}}, given.model);
  const auto file = temporary("cloud.vtp");
  write_scan(compare(given.model, cloud, {}), cloud, file);
  EXPECT_EQ(read(file)->GetOutput()->GetNumberOfVerts(), 169);
}

TEST(ComparisonFiles, SameBytesForAnyNumberOfThreads) {
  std::string skin[2], scan[2];
  for (const int threads : {1, 2}) {
    omp_set_num_threads(threads);
    const Case given;
    const Comparison comparison = compare(given.model, given.scan, given.areas);
    write_comparison(comparison, given.model, given.areas, temporary("a.vtp"));
    write_scan(comparison, given.scan, temporary("b.vtp"));
    skin[threads - 1] = bytes(temporary("a.vtp"));
    scan[threads - 1] = bytes(temporary("b.vtp"));
  }
  EXPECT_FALSE(skin[0].empty());
  EXPECT_EQ(skin[0], skin[1]);
  EXPECT_EQ(scan[0], scan[1]);
}

TEST(ComparisonFiles, FolderThatIsNotThereIsRefused) {
  const Case given;
  const Comparison comparison = compare(given.model, given.scan, {});
  EXPECT_THROW(write_scan(comparison, given.scan, temporary("missing") / "scan.vtp"), InputError);
}

}  // namespace supine::calibration
