// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/landmarks.h"
#include "meshing/mesh_io.h"
#include "reconstruction/surface_io.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

namespace fs = std::filesystem;

const char* const case_text = R"([case]
name = "dome"
frame = "LPS"
side = "left"
[image]
file = "labels.nrrd"
kind = "labels"
[image.labels]
air = [0]
adipose = [1]
muscle = [2]
[landmarks]
prone = "prone_landmarks.csv"
[pose.prone]
gravity = [0, -1, 0]
[pose.supine]
gravity = [0, 1, 0]
surface = "supine.vtp"
noise_mm = 0.5
landmarks = "supine_landmarks.csv"
[pose.upright]
gravity = [0, 0, -1]
[pose.tilt]
gravity = [0, 0.6, -0.8]
surface = "tilt.vtp"
)";

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return (std::stringstream() << stream.rdbuf()).str();
}

// A case whose supine shape is the dome 3 mm to the head side of its scan.
class CompareTool : public ::testing::Test {
 protected:
  const fs::path folder =
      fs::path(::testing::TempDir()) / "compare_tool" / ::testing::UnitTest::GetInstance()->current_test_info()->name();
  const fs::path out = folder / "out";
  const meshing::TetMesh mesh = testing::dome_mesh();
  reconstruction::Surface scan = skin();

  void SetUp() override {
    if (!fs::exists(fs::path(SUPINE_BIN_DIR) / "supine-compare")) GTEST_SKIP() << "supine-compare is not built";
    fs::remove_all(folder);
    fs::create_directories(out);
    std::ofstream(folder / "case.toml") << case_text;
    std::ofstream(folder / "labels.nrrd") << "not read here";
    reconstruction::write_surface(scan, folder / "supine.vtp");
    reconstruction::Surface other_scan = scan;
    other_scan.points.array() += 1e-3;
    reconstruction::write_surface(other_scan, folder / "tilt.vtp");
    write_landmarks({{"nipple"}, Points(Eigen::RowVector3d(1, 2, 4))}, folder / "prone_landmarks.csv");
    write_landmarks({{"nipple"}, Points(Eigen::RowVector3d(1, 2, 3))}, folder / "supine_landmarks.csv");
    write_landmarks({{"nipple"}, Points(Eigen::RowVector3d(1, 2, 6))}, out / "supine_landmarks.csv");
    Points positions = mesh.points;
    positions.col(2).array() += 3;
    for (const char* pose : {"supine", "upright", "tilt"}) {
      meshing::write_pose(mesh, positions, {}, {}, out / (std::string(pose) + ".vtu"));
    }
  }

  reconstruction::Surface skin() const {
    auto surface = testing::boundary_surface(mesh);
    std::vector<int> kept;
    for (int t = 0; t < surface.triangles.rows(); ++t) {
      if (surface.region[t] == static_cast<int>(reconstruction::Region::skin)) kept.push_back(t);
    }
    return {surface.points, surface.triangles(kept, Eigen::all), {}};
  }

  int run(const std::string& arguments) const {
    const std::string command = std::string(SUPINE_BIN_DIR) + "/supine-compare " + folder.string() + " " + arguments +
                                " > " + (folder / "said").string() + " 2>&1";
    return WEXITSTATUS(std::system(command.c_str()));
  }
  std::string said() const { return content(folder / "said"); }
};

}  // namespace

TEST_F(CompareTool, WritesTheFilesAndTheKeysOfTheContract) {
  ASSERT_EQ(run((out / "supine.vtu").string()), 0) << said();
  EXPECT_TRUE(fs::exists(out / "comparison.vtp") && fs::exists(out / "scan.vtp") && fs::exists(out / "scan.json"));
  const auto figures = nlohmann::json::parse(content(out / "comparison.json"));
  for (const char* key : {"mae_study_mm", "mae_mm", "rms_mm", "median_mm", "p95_mm", "hausdorff_mm", "mean_signed_mm",
                          "covered_fraction", "noise_mm"}) {
    EXPECT_TRUE(figures.at(key).is_number()) << key;
  }
  EXPECT_LE(figures.at("hausdorff_mm"), 3.0 + 1e-9);
  EXPECT_GT(figures.at("areas").size(), 4u);
  for (const char* key : {"name", "area_cm2", "mae_mm", "mean_signed_mm"}) {
    EXPECT_TRUE(figures.at("areas").at(0).contains(key)) << key;
  }
  EXPECT_EQ(figures.at("landmarks").at(0).at("name"), "nipple");
  EXPECT_NEAR(figures.at("landmarks").at(0).at("error_mm"), 3, 1e-9);
  EXPECT_NE(said().find("MAE, model to scan"), std::string::npos);
}

TEST_F(CompareTool, OtherPosesHaveTheirNameInTheFile) {
  ASSERT_EQ(run((out / "tilt.vtu").string()), 0) << said();
  EXPECT_TRUE(fs::exists(out / "comparison_tilt.vtp") && fs::exists(out / "scan_tilt.vtp"));
  ASSERT_EQ(run((out / "upright.vtu").string() + " --pose supine -o " + (folder / "other").string()), 0) << said();
  EXPECT_TRUE(fs::exists(folder / "other" / "comparison.vtp"));
}

TEST_F(CompareTool, PoseWithoutSurfaceIsRefusedAndNothingIsWritten) {
  EXPECT_EQ(run((out / "upright.vtu").string()), 2);
  EXPECT_NE(said().find("pose 'upright' has no surface; nothing to compare"), std::string::npos) << said();
  EXPECT_FALSE(fs::exists(out / "comparison_upright.vtp"));
}

TEST_F(CompareTool, OutputIsAFolder) {
  EXPECT_EQ(run((out / "supine.vtu").string() + " -o " + (out / "comparison.vtp").string()), 2);
  EXPECT_NE(said().find("folder"), std::string::npos) << said();
}

TEST_F(CompareTool, ScanInMetresIsRefused) {
  scan.points *= 1e-3;
  reconstruction::write_surface(scan, folder / "supine.vtp");
  EXPECT_EQ(run((out / "supine.vtu").string()), 2);
  EXPECT_NE(said().find("metres"), std::string::npos) << said();
  EXPECT_FALSE(fs::exists(out / "comparison.vtp"));
}

TEST_F(CompareTool, MisspeltLandmarkIsRefusedNamingTheFile) {
  write_landmarks({{"niple"}, Points(Eigen::RowVector3d(1, 2, 3))}, folder / "supine_landmarks.csv");
  EXPECT_EQ(run((out / "supine.vtu").string()), 2);
  EXPECT_NE(said().find("supine_landmarks.csv: measured landmark niple"), std::string::npos) << said();
}

TEST_F(CompareTool, ThreadsDoNotChangeAByte) {
  ASSERT_EQ(run((out / "supine.vtu").string() + " --threads 1 -o " + (folder / "one").string()), 0) << said();
  ASSERT_EQ(run((out / "supine.vtu").string() + " --threads 2 -o " + (folder / "two").string()), 0) << said();
  EXPECT_EQ(content(folder / "one" / "comparison.vtp"), content(folder / "two" / "comparison.vtp"));
  EXPECT_EQ(content(folder / "one" / "scan.vtp"), content(folder / "two" / "scan.vtp"));
  auto one = nlohmann::json::parse(content(folder / "one" / "comparison.json"));
  auto two = nlohmann::json::parse(content(folder / "two" / "comparison.json"));
  one.erase("timing");
  two.erase("timing");
  EXPECT_EQ(one, two);
}

}  // namespace supine
