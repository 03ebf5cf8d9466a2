// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/vtk_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>

#include <fstream>
#include <string>

#include "common/error.h"

namespace supine {
namespace {

namespace fs = std::filesystem;

/// A file of VTK in letters. Polygons, strips and the array of the points can be had wrong.
struct Sheet {
  const char *points = "0 0 0 9 0 0 0 9 0 9 9 0", *coordinates = "3";
  int polys = 2, strips = 0;
  const char *corners = "0 1 2 1 3 2", *offsets = "3 6", *strip_corners = "", *strip_offsets = "", *heat = "1 2 3 4";

  std::string text() const {
    const auto cells = [](const std::string& name, const std::string& connectivity, const std::string& ends) {
      return fmt::format(
          "<{0}><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">{1}</DataArray>"
          "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">{2}</DataArray></{0}>\n",
          name, connectivity, ends);
    };
    return fmt::format(
               "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
               "<PolyData><FieldData><Array type=\"String\" Name=\"frame\" NumberOfTuples=\"2\" format=\"ascii\">"
               "76 80 83 0 109 109 0</Array></FieldData>\n<Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" "
               "NumberOfLines=\"0\" NumberOfStrips=\"{}\" NumberOfPolys=\"{}\">\n"
               "<PointData><DataArray type=\"Float64\" Name=\"heat\" format=\"ascii\">{}</DataArray></PointData>\n"
               "<Points><DataArray type=\"Float64\" NumberOfComponents=\"{}\" "
               "format=\"ascii\">{}</DataArray></Points>\n",
               strips, polys, heat, coordinates, points) +
           cells("Strips", strip_corners, strip_offsets) + cells("Polys", corners, offsets) +
           "</Piece></PolyData></VTKFile>\n";
  }
};

class VtkFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / (std::string("supine_vtk_files_") + info->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }

  /// It is refused, the file and each word are named, and nobody else has printed anything.
  void expect_refused(const Sheet& sheet, const std::vector<std::string>& words) const {
    ::testing::internal::CaptureStderr();
    try {
      read_vtp(put("sheet.vtp", sheet.text()));
      ADD_FAILURE() << "read: " << sheet.text();
    } catch (const InputError& error) {
      for (const std::string& word : words)
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << word << " in: " << error.what();
      EXPECT_NE(std::string(error.what()).find("sheet.vtp: "), std::string::npos) << error.what();
    }
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  }

  fs::path folder_;
};

TEST_F(VtkFiles, ASoundSheetIsRead) {
  const auto sheet = read_vtp(put("sheet.vtp", Sheet().text()));
  EXPECT_EQ(sheet->GetNumberOfPoints(), 4);
  EXPECT_EQ(sheet->GetNumberOfPolys(), 2);
  EXPECT_EQ(field_text(*sheet, "frame"), "LPS");
  EXPECT_EQ(field_texts(*sheet, "frame"), (std::vector<std::string>{"LPS", "mm"}));
  EXPECT_EQ(field_text(*sheet, "unit"), std::nullopt);
}

TEST_F(VtkFiles, CornersMustBePointsOfTheFile) {
  Sheet sheet;
  sheet.corners = "0 1 2 1 4 2";
  expect_refused(sheet, {"face 1 names point 4, the file has 4"});
  sheet.corners = "0 -1 2 1 3 2";
  expect_refused(sheet, {"face 0 names point -1"});
}

TEST_F(VtkFiles, FacesAndStripsHaveThreeCornersAndMore) {
  Sheet two;
  two.offsets = "2 6";
  expect_refused(two, {"face 0 has 2 corners", "3 and more"});
  Sheet none;
  none.offsets = "0 6";
  expect_refused(none, {"face 0 has 0 corners"});
  Sheet strip;
  strip.strips = 1;
  strip.strip_corners = "3";
  strip.strip_offsets = "1";
  expect_refused(strip, {"strip 0 has 1 corners"});
}

TEST_F(VtkFiles, OffsetsRiseAndEndWithTheCorners) {
  for (const char* offsets : {"6 3", "-3 6", "3 600", "3 9223372036854775807", "3"}) {
    Sheet sheet;
    sheet.offsets = offsets;
    expect_refused(sheet, {});
  }
}

TEST_F(VtkFiles, PointsHaveThreeFiniteCoordinates) {
  Sheet sheet;
  sheet.points = "0 0 0 9 0 0 0 nan 0 9 9 0";
  expect_refused(sheet, {"point 2", "finite"});
  Sheet flat;
  flat.coordinates = "2";
  expect_refused(flat, {});
}

TEST_F(VtkFiles, ArraysHaveAValueForEachPoint) {
  Sheet sheet;
  sheet.heat = "1 2";
  expect_refused(sheet, {});
}

TEST_F(VtkFiles, AnotherKindACutFileAndNoneAreRefused) {
  expect_refused({.points = "0 0 0"}, {"not a readable .vtp file"});
  const fs::path sheet = put("sheet.vtp", Sheet().text());
  EXPECT_THROW(read_vtu(sheet), InputError);
  EXPECT_THROW(read_vti(sheet), InputError);
  EXPECT_THROW(read_vtp(put("cut.vtp", Sheet().text().substr(0, 700))), InputError);
  EXPECT_THROW(read_vtp(put("empty.vtp", "")), InputError);
  EXPECT_THROW(read_vtp(folder_), InputError);
  EXPECT_THROW(read_vtp(folder_ / "none.vtp"), InputError);
}

}  // namespace
}  // namespace supine
