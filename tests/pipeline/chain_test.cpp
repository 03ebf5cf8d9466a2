// SPDX-License-Identifier: AGPL-3.0-or-later
// The built tools and the Makefile on a small case, from volume to comparison.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/pipeline/process.h"
#include "tests/pipeline/small_case.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

bool contains(const std::string& text, const std::string& word) { return text.find(word) != std::string::npos; }

class Make : public testing::Test {
 protected:
  Make() { write_small_case(folder_ / "case"); }

  Finished make(const std::vector<std::string>& more = {}, const std::string& interrupt_after = "") {
    std::vector<std::string> command = {"make",
                                        "-f",
                                        std::string(SUPINE_SOURCE_DIR) + "/pipeline/Makefile",
                                        "BIN=" SUPINE_BIN_DIR,
                                        "CASE=" + (folder_ / "case").string(),
                                        "OUT=" + out().string(),
                                        "TRIANGLES=1200",
                                        "MAX_DISTANCE_MM=1.5"};
    command.insert(command.end(), more.begin(), more.end());
    return run_process(command, interrupt_after);
  }
  fs::path out() const { return folder_ / "out"; }
  /// Makes a file newer than everything made so far.
  void touch(const std::string& name) {
    fs::last_write_time(folder_ / "case" / name, fs::file_time_type::clock::now() + std::chrono::seconds(1));
  }

  TemporaryFolder folder_;
};

TEST_F(Make, TakesACaseFromVolumeToComparisonAndThenOnlyRunsWhatChanged) {
  const Finished first = make();
  ASSERT_EQ(first.code, 0) << first.err;
  for (const char* name : {"labels.vti", "breast.vtp", "muscle.vtp", "coarse.vtp", "mesh.vtu", "prone.vtu",
                           "undeformed.vtu", "supine.vtu", "comparison.vtp", "scan.vtp"}) {
    EXPECT_TRUE(fs::exists(out() / name)) << name;
    EXPECT_TRUE(fs::exists((out() / name).replace_extension(".json"))) << name;
  }
  expect_words(first.out, {"RMS", "tetrahedra", "sag"});
  EXPECT_TRUE(files_in(folder_ / "case/out").empty());

  const Finished second = make();
  EXPECT_EQ(second.code, 0);
  EXPECT_FALSE(contains(second.out, "supine-")) << second.out;

  touch("model.toml");
  const Finished third = make();
  EXPECT_EQ(third.code, 0) << third.err;
  EXPECT_FALSE(contains(third.out, "supine-tetrahedralise")) << third.out;
  EXPECT_TRUE(contains(third.out, "supine-simulate"));
  EXPECT_TRUE(contains(third.out, "supine-compare"));

  const Finished coarser = make({"TRIANGLES=1000", "decimate"});
  EXPECT_FALSE(contains(coarser.out, "supine-reconstruct")) << coarser.out;
  EXPECT_TRUE(contains(coarser.out, "supine-decimate"));
}

TEST_F(Make, SkipsTheComparisonWhereThereIsNoScanAndSaysSo) {
  write_text(folder_ / "case/case.toml", replaced(small_case_toml(), "surface = \"supine.ply\"\n", ""));
  const Finished finished = make();
  EXPECT_EQ(finished.code, 0) << finished.err;
  expect_words(finished.out, {"compare is skipped"});
  EXPECT_TRUE(fs::exists(out() / "supine.vtu"));
  EXPECT_FALSE(fs::exists(out() / "comparison.vtp"));
  EXPECT_EQ(make({"compare"}).code, 2);
}

TEST_F(Make, GoesOnAfterAnInterruption) {
  const Finished stopped = make({}, "supine-tetrahedralise");
  EXPECT_NE(stopped.code, 0);
  for (const std::string& name : files_in(out())) EXPECT_FALSE(contains(name, ".part")) << name;
  const Finished second = make();
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_FALSE(contains(second.out, "supine-segment")) << second.out;
  EXPECT_TRUE(fs::exists(out() / "comparison.vtp"));
}

TEST_F(Make, SaysWhichFileIsMissing) {
  fs::remove(folder_ / "case/model.toml");
  Finished finished = make();
  EXPECT_EQ(finished.code, 2);
  expect_words(finished.err, {"model.toml", "is not there"});
  fs::remove(folder_ / "case/case.toml");
  finished = make();
  EXPECT_EQ(finished.code, 2);
  expect_words(finished.err, {"case.toml", "is not there"});
}

TEST_F(Make, StopsAtBadInput) {
  write_text(folder_ / "case/case.toml", replaced(small_case_toml(), "muscle = [3]", "muscle = []"));
  const Finished finished = make();
  EXPECT_EQ(finished.code, 2);
  expect_words(finished.err, {"case.toml:", "muscle"});
  EXPECT_TRUE(files_in(out()).empty());
}

TEST(Tools, AllSayTheirNameVersionAndCommonOptions) {
  for (const char* name : {"segment", "reconstruct", "decimate", "tetrahedralise", "simulate", "compare", "model"}) {
    const Finished help = run_process({tool(name), "--help"});
    EXPECT_EQ(help.code, 0) << name;
    expect_words(help.out, {"Examples:", "--output", "--threads", "--json", "--force", "--quiet", "--version"});
    const Finished version = run_process({tool(name), "--version"});
    EXPECT_EQ(version.code, 0) << name;
    expect_words(version.out, {"supine-" + std::string(name), "OpenBLAS"});
    EXPECT_EQ(run_process({tool(name), "--no-such-option"}).code, 2) << name;
  }
}

TEST(Tools, OfTheSmallCaseReportWhatOthersRelyOn) {
  const Json supine = Json::parse(read_text(small_run() / "out/supine.json"));
  for (const char* key : {"round_trip_max_mm", "newton_iterations", "load_steps", "min_det_f"})
    EXPECT_TRUE(supine.contains(key)) << key;
  EXPECT_LE(supine["round_trip_max_mm"], 1e-6);
  EXPECT_GT(supine["min_det_f"], 0);
  const Json comparison = Json::parse(read_text(small_run() / "out/comparison.json"));
  for (const char* key : {"mae_study_mm", "mae_mm", "rms_mm", "median_mm", "p95_mm", "hausdorff_mm", "mean_signed_mm",
                          "covered_fraction", "areas", "landmarks"})
    EXPECT_TRUE(comparison.contains(key)) << key;
}

/// All outputs of one stage but the timing of their sidecars.
std::map<std::string, std::string> bytes_of(const fs::path& folder) {
  std::map<std::string, std::string> bytes;
  for (const std::string& name : files_in(folder)) {
    bytes[name] = read_text(folder / name);
    if (!name.ends_with(".json")) continue;
    Json json = Json::parse(bytes[name]);
    json.erase("timing");
    bytes[name] = json.dump();
  }
  return bytes;
}

TEST(Tools, GiveTheSameBytesElsewhereAndWithOneThread) {
  TemporaryFolder folder;
  write_small_case(folder.path());
  for (const char* stage : {"segment", "reconstruct", "decimate", "tetrahedralise", "simulate", "compare"}) {
    auto command = stage_command(stage, folder.path());
    command.back() = "1";
    ASSERT_LE(run_process(command).code, 1) << stage;
  }
  const auto here = bytes_of(folder / "out"), there = bytes_of(small_run() / "out");
  ASSERT_EQ(here.size(), there.size());
  for (const auto& [name, bytes] : here) EXPECT_TRUE(bytes == there.at(name)) << name << " differs";
}

TEST(Tools, EndWith130OnCtrlCAndLeaveNoFile) {
  TemporaryFolder folder;
  write_small_case(folder.path());
  fs::create_directories(folder / "out");
  fs::copy_file(small_run() / "out/mesh.vtu", folder / "out/mesh.vtu");
  const auto before = files_in(folder.path());
  const Finished finished = run_process(stage_command("simulate", folder.path()), "supine-simulate");
  EXPECT_EQ(finished.code, 130) << finished.err;
  expect_words(finished.err, {"interrupted"});
  EXPECT_EQ(files_in(folder.path()), before);
}

}  // namespace
}  // namespace supine::pipeline
