// SPDX-License-Identifier: AGPL-3.0-or-later
// The built supine-targets on the run that the tests of the pipeline share, and what supine-compare makes of it.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/landmarks.h"
#include "tests/pipeline/process.h"
#include "tests/pipeline/simulated_scan.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class TargetsTool : public testing::Test {
 protected:
  void SetUp() override {
    run_process({"cp", "-a", small_run().string(), case_.string()});
    write_text(case_ / "inside.csv", "name,x,y,z\nnear,0,-33,4\ndeep,12,-18,-10\n");
  }

  Finished run(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {tool("targets"),     case_.string(),       (case_ / "out/mesh.vtu").string(),
                                      "--no-other-meshes", "--no-further-scans", "-o",
                                      found_.string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_process(words);
  }
  std::vector<std::string> inside() const { return {"--points", (case_ / "inside.csv").string()}; }
  Json json() const { return Json::parse(std::ifstream(found_ / "supine_landmarks.json")); }

  TemporaryFolder folder_;
  fs::path case_ = folder_ / "case", found_ = folder_ / "found";
};

TEST_F(TargetsTool, WritesLandmarksThatEveryToolReadsWithTheirRegions) {
  const Finished finished = run(inside());
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Landmarks marks = read_landmarks(found_ / "supine_landmarks.csv");
  const Json f = json();
  EXPECT_TRUE(f["scan_counts"].get<bool>());
  EXPECT_GT(f["unexplained_mm"].get<double>(), 0);
  ASSERT_EQ(marks.names, (std::vector<std::string>{"near", "deep"}));
  for (int p = 0; p < 2; ++p) {
    const Json& point = f["points"][static_cast<std::size_t>(p)];
    EXPECT_NEAR(marks.sigma_mm[p], point["sigma_mm"].get<double>(), 1e-3);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(marks.points(p, axis), point["place_mm"][static_cast<std::size_t>(axis)].get<double>(), 1e-3);
    EXPECT_GT(point["half_axes_mm"][2].get<double>(), 0);
  }
  // The small body is a dome 30 mm high over a muscle at y = -9: the deep point has more over it.
  EXPECT_GT(f["points"][1]["nearest_skin"]["mm"].get<double>(), f["points"][0]["nearest_skin"]["mm"].get<double>() + 3);
  EXPECT_GE(f["points"][1]["vertical_skin"]["mm"].get<double>(), f["points"][1]["nearest_skin"]["mm"].get<double>());
  const std::string bytes = read_text(found_ / "supine_landmarks.csv");
  std::vector<std::string> again = inside();
  again.insert(again.end(), {"--force", "--threads", "1"});
  ASSERT_EQ(run(again).code, 0);
  EXPECT_EQ(read_text(found_ / "supine_landmarks.csv"), bytes) << "the same bytes for any number of threads";
}

TEST_F(TargetsTool, WithoutAScanGoesByPriorsAndIsLessSure) {
  ASSERT_EQ(run(inside()).code, 0);
  const double known = json()["points"][1]["sigma_mm"];
  write_text(case_ / "case.toml", replaced(read_text(case_ / "case.toml"), "surface = \"supine.ply\"\n", ""));
  std::vector<std::string> words = inside();
  words.insert(words.end(), {"--force", "--draws", "5"});
  const Finished finished = run(words);
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json f = json();
  EXPECT_FALSE(f["scan_counts"].get<bool>());
  EXPECT_TRUE(f["landmarks"].is_null());
  EXPECT_EQ(f["draws"]["draws"], 5);
  EXPECT_EQ(f["draws"]["points"].size(), 2u);
  EXPECT_GT(f["points"][1]["sigma_mm"].get<double>(), 0.3);
  EXPECT_GT(known, 0.3);
}

TEST_F(TargetsTool, AnotherModelIsWhereTheFitBeginsWithThePriorsOfTheCase) {
  write_simulated_scan(case_ / "out/supine.vtu", case_ / "simulated.vtp");
  write_text(case_ / "case.toml", replaced(read_text(case_ / "case.toml"), "supine.ply", "simulated.vtp"));
  ASSERT_EQ(run(inside()).code, 0);
  const Json own = json()["points"];
  write_text(case_ / "calibrated.toml",
             replaced(read_text(case_ / "model.toml"), "{ value = 2.0, prior_sd = 1.0, lower = 0.1, upper = 20 }",
                      "{ value = 1.3, prior_sd = 0.01, lower = 0.1, upper = 20 }"));
  std::vector<std::string> words = inside();
  words.insert(words.end(), {"--model", (case_ / "calibrated.toml").string(), "--force"});
  const Finished finished = run(words);
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json begun = json()["points"];
  for (std::size_t p = 0; p < own.size(); ++p) {
    const double sigma_mm = own[p]["sigma_mm"];
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(begun[p]["place_mm"][axis].get<double>(), own[p]["place_mm"][axis].get<double>(), 0.5 * sigma_mm);
    EXPECT_NEAR(begun[p]["sigma_mm"].get<double>(), sigma_mm, 0.15 * sigma_mm);
  }
}

TEST_F(TargetsTool, APointOutsideIsToldAndLeftOut) {
  write_text(case_ / "inside.csv", "name,x,y,z\nnear,0,-33,4\naway,0,-80,0\n");
  const Finished finished = run(inside());
  EXPECT_EQ(finished.code, 1);
  expect_words(finished.err, {"'away'", "outside the body", "left out"});
  EXPECT_EQ(json()["points"].size(), 1u);
}

TEST_F(TargetsTool, SaysWhatLandmarksShouldBeOffAndCompareTestsThem) {
  write_text(case_ / "prone.csv", "name,x,y,z\nnipple,0,-39,0\nupper,3,-29.2,24\n");
  write_text(case_ / "supine.csv", "name,x,y,z\nnipple,0,-31.5,0\nupper,3,-24.2,24\n");
  write_text(case_ / "case.toml",
             replaced(read_text(case_ / "case.toml"), "supine.ply\"\n", "supine.ply\"\nlandmarks = \"supine.csv\"\n") +
                 "[landmarks]\nprone = \"prone.csv\"\n");
  const Finished finished = run();
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json told = json()["landmarks"];
  ASSERT_EQ(told["names"], (std::vector<std::string>{"nipple", "upper"}));
  write_text(case_ / "out/supine_landmarks.csv", "name,x,y,z\nnipple,0,-31,0\nupper,3,-24,24\n");
  const Finished compared =
      run_process({tool("compare"), case_.string(), (case_ / "out/supine.vtu").string(), "--expected",
                   (found_ / "supine_landmarks.json").string(), "-o", found_.string()});
  ASSERT_EQ(compared.code, 0) << compared.err;
  const Json comparison = Json::parse(std::ifstream(found_ / "comparison.json"));
  EXPECT_NEAR(comparison["landmark_test"]["p_value"].get<double>(), told["p_value"].get<double>(), 1e-9);
  EXPECT_EQ(comparison["landmark_test"]["degrees"], 6);
  for (const Json& row : comparison["landmarks"]) {
    EXPECT_NEAR(row["error_mm"].get<double>(), row["name"] == "nipple" ? 0.5 : 0.2, 1e-6);
    EXPECT_GT(row["expected_mm"].get<double>(), 1.5);
    EXPECT_GE(row["off_expected_mm"].get<double>(), 0);
  }
  EXPECT_EQ(finished.err.find("does not have them"), std::string::npos) << finished.err;
  write_text(case_ / "supine.csv", "name,x,y,z,sigma_mm\nnipple,9,-31.5,0,0.3\nupper,-6,-24.2,24,0.3\n");
  const Finished elsewhere = run({"--force"});
  EXPECT_EQ(elsewhere.code, 0) << elsewhere.err;
  expect_words(elsewhere.err, {"landmarks in supine", "p = ", "supine-diagnose", "--model"});
}

}  // namespace
}  // namespace supine::pipeline
