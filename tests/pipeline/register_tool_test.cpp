// SPDX-License-Identifier: AGPL-3.0-or-later
// The built supine-register on the run that the tests of the pipeline share.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pipeline/case/scan_case.h"
#include "reconstruction/surface_io.h"
#include "registration/transform_file.h"
#include "tests/pipeline/process.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class RegisterTool : public testing::Test {
 protected:
  void SetUp() override { run_process({"cp", "-a", small_run().string(), case_.string()}); }

  Finished run(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {tool("register"), case_.string(), "-o", found_.string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_process(words);
  }

  TemporaryFolder folder_;
  fs::path case_ = folder_ / "case", found_ = folder_ / "found";
};

TEST_F(RegisterTool, BringsAShiftedScanBackAndSaysHowSure) {
  const Eigen::RowVector3d shift(3, -4, 5);
  // The model's own skin, so that nothing but its place is wrong.
  reconstruction::Surface scan = reconstruction::read_surface(case_ / "out/comparison.vtp", "LPS");
  const Points there = scan.points;
  scan.points.rowwise() += shift;
  reconstruction::write_surface(scan, case_ / "shifted.vtp");
  write_text(case_ / "case.toml", replaced(read_text(case_ / "case.toml"), "supine.ply", "shifted.vtp"));
  const Finished finished = run({"--png", (found_ / "placement.png").string()});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json json = Json::parse(std::ifstream(found_ / "registration.json"));
  for (int axis = 0; axis < 3; ++axis) {
    const double sd = json["sd"][axis];
    EXPECT_GT(sd, 0);
    EXPECT_NEAR(json["shift_mm"][axis].get<double>(), -shift[axis], 3 * sd) << axis;
  }
  // Of a perfect scan of all of the skin nothing is left, at its border neither.
  EXPECT_LT(json["rms_after_mm"].get<double>(), 1);
  EXPECT_GT(json["rms_before_mm"].get<double>(), 2);
  EXPECT_GT(json["overlap"].get<double>(), 0.97);
  EXPECT_GT(fs::file_size(found_ / "placement.png"), 10000u);
  const Points moved = reconstruction::read_surface(found_ / "registered.vtp", "LPS").points;
  const auto transform = registration::read_tfm(found_ / "registration.tfm");
  EXPECT_LT((transform.apply(scan.points) - moved).rowwise().norm().maxCoeff(), 1e-6) << "the file moves the same";
  const double off = std::sqrt((moved - there).squaredNorm() / static_cast<double>(there.rows()));
  EXPECT_LT(off, 1.5) << "from 7 mm";
}

TEST_F(RegisterTool, SaysThatTheGivenPlaceMayBeTheBetterOne) {
  // A millimetre is less than a soft body's shape can tell.
  reconstruction::Surface scan = reconstruction::read_surface(case_ / "out/comparison.vtp", "LPS");
  scan.points.rowwise() += Eigen::RowVector3d(0.6, -0.6, 0.6);
  reconstruction::write_surface(scan, case_ / "shifted.vtp");
  write_text(case_ / "case.toml", replaced(read_text(case_ / "case.toml"), "supine.ply", "shifted.vtp"));
  const Finished finished = run();
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json json = Json::parse(std::ifstream(found_ / "registration.json"));
  EXPECT_TRUE(json["given_inside_95"].get<bool>());
  EXPECT_NE((finished.out + finished.err).find("95 % region holds"), std::string::npos) << finished.out;
}

/// 1 sigma of a bony landmark, of what the two files say of it.
double landmark_sigma_mm(const fs::path& folder, const std::string& imaged, const std::string& measured) {
  const auto write = [&folder](const char* file, const char* place, const std::string& sigma) {
    write_text(folder / file,
               "name,x,y,z" + std::string(sigma.empty() ? "" : ",sigma_mm") + "\nrib," + place + sigma + "\n");
  };
  write("imaged.csv", "20,5,-30", imaged);
  write("measured.csv", "20,5,-30.5", measured);
  const std::string plain = read_text(folder / "case.toml"), key = "surface = \"supine.ply\"";
  write_text(folder / "case.toml", replaced(plain, key, key + "\nlandmarks = \"measured.csv\"") +
                                       "\n[landmarks]\nprone = \"imaged.csv\"\n[register]\nrigid = [\"rib\"]\n");
  const Case description = read_case(folder);
  write_text(folder / "case.toml", plain);
  return read_scan_case(description, description.pose("supine"), folder / "out/supine.vtu")
      .problem.landmarks.at(0)
      .sigma_mm;
}

TEST_F(RegisterTool, LandmarksAreKnownAsInTheDiagnosis) {
  EXPECT_EQ(landmark_sigma_mm(case_, "", ""), 1.5);
  EXPECT_EQ(landmark_sigma_mm(case_, "", ",0.4"), 0.4);
  EXPECT_EQ(landmark_sigma_mm(case_, ",0.3", ",0.4"), 0.5);
}

TEST_F(RegisterTool, RefusesWithoutAShapeAndWritesNothing) {
  fs::remove(case_ / "out/supine.vtu");
  const Finished finished = run();
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("supine-simulate"), std::string::npos) << finished.err;
  EXPECT_FALSE(fs::exists(found_));
}

TEST_F(RegisterTool, RefusesAScanInMetres) {
  reconstruction::Surface scan = reconstruction::read_surface(case_ / "supine.ply", "LPS");
  scan.points *= 0.001;
  reconstruction::write_surface(scan, case_ / "metres.vtp");
  write_text(case_ / "case.toml", replaced(read_text(case_ / "case.toml"), "supine.ply", "metres.vtp"));
  const Finished finished = run();
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("metres"), std::string::npos) << finished.err;
}

}  // namespace
}  // namespace supine::pipeline
