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

/// A case that has been made already, in a folder of its own.
class Make : public testing::Test {
 protected:
  Make() { run_process({"cp", "-a", small_run().string(), case_folder().string()}); }

  Finished make(std::vector<std::string> more = {}, const std::string& interrupt_after = "") {
    std::vector<std::string> command = make_command(case_folder());
    command.insert(command.end(), more.begin(), more.end());
    return run_process(command, interrupt_after);
  }
  fs::path case_folder() const { return folder_ / "case"; }
  fs::path out() const { return case_folder() / "out"; }
  /// Makes a file newer than everything made so far.
  void touch(const std::string& name) {
    fs::last_write_time(case_folder() / name, fs::file_time_type::clock::now() + std::chrono::seconds(1));
  }
  /// Changes a file without make noticing.
  void rewrite(const std::string& name, const std::string& text) {
    const auto time = fs::last_write_time(case_folder() / name);
    write_text(case_folder() / name, text);
    fs::last_write_time(case_folder() / name, time);
  }

  TemporaryFolder folder_;
};

TEST_F(Make, LeavesEveryFileOfTheChainWithItsSidecar) {
  for (const char* name : {"labels.vti", "breast.vtp", "muscle.vtp", "coarse.vtp", "mesh.vtu", "prone.vtu",
                           "undeformed.vtu", "supine.vtu", "comparison.vtp", "scan.vtp"}) {
    EXPECT_TRUE(fs::exists(out() / name)) << name;
    EXPECT_TRUE(fs::exists((out() / name).replace_extension(".json"))) << name;
  }
}

TEST_F(Make, RunsNothingAgainAndPrintsTheFigures) {
  const Finished finished = make();
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_FALSE(contains(finished.out, "supine-")) << finished.out;
  expect_words(finished.out, {"RMS", "tetrahedra", "sag", "comparison.vtp"});
}

TEST_F(Make, PrintsTheBlockOfAStageThatIsUpToDateAgain) {
  fs::remove(out() / "comparison.vtp");
  const Finished first = make({"compare"});
  expect_words(first.out, {"== compare supine", "MAE, scan to model"});
  const Finished second = make({"compare"});
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_FALSE(contains(second.out, "==")) << "run again: " << second.out;
  EXPECT_EQ("== compare supine\n" + second.out, first.out);
}

TEST_F(Make, RunsOnlyWhatDependsOnTheChange) {
  touch("supine.ply");
  const Finished scan = make({"-n"});
  EXPECT_FALSE(contains(scan.out, "supine-simulate")) << scan.out;
  expect_words(scan.out, {"supine-compare"});
  touch("model.toml");
  const Finished model = make({"-n"});
  EXPECT_FALSE(contains(model.out, "supine-tetrahedralise")) << model.out;
  expect_words(model.out, {"supine-simulate", "supine-compare"});
  touch("labels.nrrd");
  expect_words(make({"decimate"}).out, {"supine-segment", "supine-reconstruct", "supine-decimate"});
}

TEST_F(Make, DecimatesAgainWhenAskedForAnotherSize) {
  const Finished finished = make({"TRIANGLES=700", "decimate"});
  EXPECT_FALSE(contains(finished.out, "supine-reconstruct")) << finished.out;
  expect_words(finished.out, {"supine-decimate"});
}

TEST_F(Make, MeshesWithQuadraticCellsBentOntoTheFineSurfaceUnlessToldOtherwise) {
  std::vector<std::string> command = make_command(case_folder());
  std::erase_if(command, [](const std::string& word) { return word == "ORDER=1" || word == "TRIANGLES=800"; });
  command.insert(command.end(), {"-n", "mesh"});
  const Finished finished = run_process(command);
  ASSERT_EQ(finished.code, 0) << finished.err;
  expect_words(finished.out, {"supine-decimate", "--order 2", "supine-tetrahedralise", "--order 2 --fine"});
  EXPECT_FALSE(contains(finished.out, "--triangles")) << finished.out;
}

TEST_F(Make, WritesElsewhereWhenTheCaseIsReadOnly) {
  fs::remove_all(out());
  const auto before = files_in(case_folder());
  const Finished finished = make({"OUT=" + (folder_ / "elsewhere").string(), "segment"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_TRUE(fs::exists(folder_ / "elsewhere/labels.vti"));
  EXPECT_EQ(files_in(case_folder()), before);
}

TEST_F(Make, SkipsTheComparisonWhereThereIsNoScanAndSaysSo) {
  rewrite("case.toml", replaced(small_case_toml(), "surface = \"supine.ply\"\n", ""));
  fs::remove(out() / "comparison.vtp");
  const Finished finished = make();
  EXPECT_EQ(finished.code, 0) << finished.err;
  expect_words(finished.out, {"compare is skipped"});
  EXPECT_FALSE(contains(finished.out, "MAE")) << "figures of an earlier comparison: " << finished.out;
  EXPECT_FALSE(fs::exists(out() / "comparison.vtp"));
  EXPECT_EQ(make({"compare"}).code, 2);
}

TEST_F(Make, GoesOnAfterAnInterruption) {
  for (const char* name : {"coarse.vtp", "mesh.vtu", "supine.vtu", "comparison.vtp"}) fs::remove(out() / name);
  const Finished stopped = make({}, "supine-tetrahedralise");
  EXPECT_NE(stopped.code, 0);
  EXPECT_FALSE(fs::exists(out() / "supine.vtu"));
  for (const std::string& name : files_in(out())) EXPECT_FALSE(contains(name, ".part")) << name;
  const Finished second = make();
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_FALSE(contains(second.out, "supine-decimate")) << second.out;
  EXPECT_TRUE(fs::exists(out() / "comparison.vtp"));
}

TEST_F(Make, SaysWhichFileIsMissing) {
  fs::remove(case_folder() / "model.toml");
  Finished finished = make();
  EXPECT_EQ(finished.code, 2);
  expect_words(finished.err, {"model.toml", "is not there"});
  fs::remove(case_folder() / "case.toml");
  finished = make();
  EXPECT_EQ(finished.code, 2);
  expect_words(finished.err, {"case.toml", "is not there"});
}

TEST_F(Make, StopsAtBadInput) {
  fs::remove_all(out());
  write_text(case_folder() / "case.toml", replaced(small_case_toml(), "muscle = [3]", "muscle = []"));
  const Finished finished = make();
  EXPECT_EQ(finished.code, 2);
  expect_words(finished.err, {"case.toml:", "muscle"});
  // The settings make compares with the next time are all there may be.
  for (const std::string& name : files_in(out())) EXPECT_TRUE(contains(name, "-settings")) << name;
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
    if (name.starts_with(".")) continue;
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
