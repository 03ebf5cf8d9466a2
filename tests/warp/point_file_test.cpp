// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/point_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/error.h"
#include "tests/segmentation/formats/image_files.h"
#include "tests/warp/two_shapes.h"
#include "warp/carry_points.h"

namespace supine::warp {
namespace {

namespace fs = std::filesystem;
using segmentation::testing::message_of;
using segmentation::testing::TemporaryFolder;
using segmentation::testing::write_text;

// As 3D Slicer 5 writes them.
const std::string fcsv_text =
    "# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n"
    "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    "vtkMRMLMarkupsFiducialNode_0,-10.5,-20.25,30,0,0,0,1,1,1,0,clip,\"a, b\",,2,0\n"
    "vtkMRMLMarkupsFiducialNode_1,-12,-8,5,0,0,0,1,1,1,0,tumour,,,2,0\n";

std::string markups_text(const std::string& frame, const std::string& kind = "Curve") {
  return R"({"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
  "markups": [{"type": ")" +
         kind + R"(", "coordinateSystem": ")" + frame + R"(", "coordinateUnits": "mm", "locked": false,
    "controlPoints": [
      {"id": "1", "label": "C-1", "position": [10.0, 20.0, 30.0], "orientation": [-1.0, -0.0, -0.0, -0.0, -1.0, -0.0, 0.0, 0.0, 1.0], "positionStatus": "defined"},
      {"id": "2", "label": "C-2", "position": [30.0, 20.0, 30.0], "positionStatus": "defined"},
      {"id": "3", "label": "C-3", "position": [0.0, 0.0, 0.0], "positionStatus": "undefined"}],
    "measurements": [{"name": "length", "value": 20.0}], "display": {"color": [1.0, 0.5, 0.5]}}]})";
}

std::string text_of(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST(PointFile, FcsvKeepsItsFrameAndEverythingButThePlaces) {
  const TemporaryFolder folder;
  write_text(folder / "a.fcsv", fcsv_text);
  const PointFile file(folder / "a.fcsv", "LPS");
  EXPECT_EQ(file.names(), (std::vector<std::string>{"clip", "tumour"}));
  EXPECT_EQ(file.points().row(0), Eigen::RowVector3d(10.5, 20.25, 30)) << "RAS in the file, LPS here";
  Points moved = file.points();
  moved.row(1) << 1, 2, 3;
  file.write(moved, folder / "b.fcsv");
  const PointFile again(folder / "b.fcsv", "LPS");
  EXPECT_LT((again.points() - moved).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_NE(text_of(folder / "b.fcsv").find("_1,-1.000000,-2.000000,3.000000,0,0,0,1,1,1,0,tumour,,,2,0\n"),
            std::string::npos);
  EXPECT_NE(text_of(folder / "b.fcsv").find("clip,\"a, b\",,2,0\n"), std::string::npos);
}

TEST(PointFile, MarkupsKeepFrameKindAndUndefinedPoints) {
  const TemporaryFolder folder;
  for (const std::string& frame : std::vector<std::string>{"LPS", "RAS"}) {
    write_text(folder / "a.mrk.json", markups_text(frame));
    const PointFile file(folder / "a.mrk.json", "LPS");
    const double sign = frame == "LPS" ? 1 : -1;
    ASSERT_EQ(file.points().rows(), 2) << "an undefined point is none";
    EXPECT_EQ(file.points().row(0), Eigen::RowVector3d(10 * sign, 20 * sign, 30));
    EXPECT_TRUE(file.groups().at(0).connected());
    Points moved = file.points();
    moved.row(0) << 1, 2, 3;
    file.write(moved, folder / "b.mrk.json");
    const auto json = nlohmann::json::parse(text_of(folder / "b.mrk.json"));
    const auto& markup = json["markups"][0];
    EXPECT_EQ(markup["coordinateSystem"], frame);
    EXPECT_EQ(markup["controlPoints"][0]["position"], (nlohmann::json{sign * 1, sign * 2, 3}));
    EXPECT_EQ(markup["controlPoints"][2]["positionStatus"], "undefined");
    EXPECT_EQ(markup["controlPoints"][0]["orientation"].size(), 9u);
    EXPECT_EQ(markup["display"]["color"].size(), 3u);
    EXPECT_FALSE(markup.contains("measurements")) << "the length of the old place";
  }
}

TEST(PointFile, ATableStaysInTheFrameOfTheCase) {
  const TemporaryFolder folder;
  write_text(folder / "a.csv", "name,x,y,z\nclip,-10,-20,30\n");
  const PointFile file(folder / "a.csv", "RAS");
  EXPECT_EQ(file.points().row(0), Eigen::RowVector3d(10, 20, 30));
  file.write(file.points(), folder / "b.csv");
  EXPECT_EQ(text_of(folder / "b.csv"), "name,x,y,z\nclip,-10.000,-20.000,30.000\n");
}

TEST(PointFile, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  const auto complaint = [&](const std::string& name, const std::string& text) {
    write_text(folder / name, text);
    return message_of([&] { PointFile(folder / name, "LPS"); });
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(complaint("a.txt", "x"), ".mrk.json"));
  EXPECT_TRUE(has(complaint("a.fcsv", "a,1,2,3\n"), "CoordinateSystem"));
  EXPECT_TRUE(has(complaint("b.fcsv", "# CoordinateSystem = LPS\na,1,nan,3\n"), "b.fcsv:2"));
  EXPECT_TRUE(has(complaint("c.fcsv", "# CoordinateSystem = IJK\n"), "neither LPS nor RAS"));
  EXPECT_TRUE(has(complaint("d.fcsv", "# CoordinateSystem = LPS\n"), "no points"));
  EXPECT_TRUE(has(complaint("a.mrk.json", "{\"markups\": ["), "JSON"));
  EXPECT_TRUE(has(complaint("b.mrk.json", "{}"), "markups"));
  EXPECT_TRUE(has(complaint("c.mrk.json", markups_text("IJK")), "neither LPS nor RAS"));
  EXPECT_TRUE(has(complaint("d.mrk.json", markups_text("LPS", "Plane")), "Plane"));
  std::string metres = markups_text("LPS");
  metres.replace(metres.find("\"mm\""), 4, "\"m\"");
  EXPECT_TRUE(has(complaint("e.mrk.json", metres), "mm expected"));
  std::string text = markups_text("LPS");
  text.replace(text.find("[10.0, 20.0, 30.0]"), 18, "[10.0, 20.0]");
  EXPECT_TRUE(has(complaint("f.mrk.json", text), "C-1"));
}

class CarryPoints : public ::testing::TestWithParam<int> {};

TEST_P(CarryPoints, ThereAndBackIsWhereTheyWere) {
  const testing::MovedBox box = testing::moved_box(GetParam(), testing::bent);
  Points points(64, 3);
  for (int n = 0; n < 64; ++n) points.row(n) << 4 + 10 * (n % 4), 4 + 10 * (n / 4 % 4), 4 + 10 * (n / 16);
  const CarriedPoints there = carry_points(box.shapes(), points, {}, "points");
  EXPECT_EQ(there.left_behind(), 0u);
  EXPECT_GT((there.places - points).rowwise().norm().maxCoeff(), 5);
  const CarriedPoints back = carry_points(box.back(), there.places, {}, "points");
  EXPECT_LT((back.places - points).cwiseAbs().maxCoeff(), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Orders, CarryPoints, ::testing::Values(1, 2));

TEST(CarryPointsOutside, StayAndAreTold) {
  const testing::MovedBox box = testing::moved_box(1, testing::affine);
  Points points(3, 3);
  points << 20, 20, 20, 20, 20, 42, 20, 20, 50;
  const CarriedPoints carried = carry_points(box.shapes(), points, {}, "points");
  EXPECT_EQ(carried.left_behind(), 1u);
  EXPECT_FALSE(carried.was_carried[2]);
  EXPECT_EQ(carried.places.row(2), points.row(2));
  EXPECT_NEAR(carried.outside_mm[2], 10, 1e-9);
  EXPECT_LT((carried.places.row(1).transpose() - testing::affine(points.row(1).transpose())).norm(), 1e-9);
}

TEST(CarryPointsOutside, AllOfThemAreRefusedAndAnotherFrameNamed) {
  const testing::MovedBox box = testing::moved_box(1, testing::affine);
  Points points(1, 3);
  points << -20, -20, 20;
  EXPECT_NE(message_of([&] { carry_points(box.shapes(), points, {}, "points"); }).find("RAS"), std::string::npos);
}

TEST(CarryPointsCurve, SaysWhatACurveIsOffByBetweenItsPoints) {
  const auto arch = [](const Eigen::Vector3d& x) {
    return Eigen::Vector3d(x.x(), x.y(), x.z() + 8 * (1 - std::abs(x.x() - 20) / 20));
  };
  const testing::MovedBox box = testing::moved_box(2, arch);
  Points points(2, 3);
  points << 0, 20, 20, 40, 20, 20;
  const CarriedPoints carried = carry_points(box.shapes(), points, {{"cut", "Curve", 0, 2}}, "points");
  EXPECT_NEAR(carried.between_mm[0], 8, 2);
  const CarriedPoints straight = carry_points(box.shapes(), points, {{"two", "Fiducial", 0, 2}}, "points");
  EXPECT_EQ(straight.between_mm[0], 0);
}

}  // namespace
}  // namespace supine::warp
