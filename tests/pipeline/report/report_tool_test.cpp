// SPDX-License-Identifier: AGPL-3.0-or-later
// supine-report on a small case that went as far as the comparison.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "meshing/mesh_io.h"
#include "pipeline/report/page.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class ReportTool : public testing::Test {
 protected:
  ReportTool() { run_process({"cp", "-a", small_run().string(), case_folder().string()}); }

  Finished report(std::vector<std::string> more = {}) const {
    std::vector<std::string> command = {tool("report"), case_folder().string()};
    command.insert(command.end(), more.begin(), more.end());
    return run_process(command);
  }
  /// The data that the page carries.
  Json data() const {
    const std::string page = read_text(out() / "report.html"), mark = "id=\"supine-data\">";
    const auto from = page.find(mark) + mark.size();
    return Json::parse(page.substr(from, page.find("</script>", from) - from));
  }
  fs::path case_folder() const { return folder_ / "case"; }
  fs::path out() const { return case_folder() / "out"; }

  TemporaryFolder folder_;
};

TEST_F(ReportTool, WritesOneSmallPageThatNeedsNothingElse) {
  const Finished finished = report();
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_LT(fs::file_size(out() / "report.html"), 15e6);
  const std::string page = read_text(out() / "report.html");
  for (const char* outside : {"src=\"http", "href=\"http", "@import", "<link rel=\"stylesheet\""})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  const Json here = data();
  EXPECT_EQ(here["figures"]["comparison.json"]["rms_mm"], Json::parse(read_text(out() / "comparison.json"))["rms_mm"]);
  EXPECT_EQ(here["shapes"]["states"].size(), 1u);
  EXPECT_TRUE(here["shapes"]["states"][0]["poses"]["supine"].contains("scan_distance_mm"));
  EXPECT_EQ(Json::parse(read_text(out() / "report.json"))["bytes"], page.size());
}

TEST_F(ReportTool, SaysWhatHasNotRunAndHowToRunIt) {
  const Finished finished = report();
  expect_words(finished.out, {"not run: calibrate", "make CASE=", "diagnose"});
  const Json answer = data()["answer"];
  EXPECT_EQ(answer["kind"], "not_diagnosed");
}

TEST_F(ReportTool, TheSameFilesGiveTheSameBytes) {
  ASSERT_EQ(report({"--threads", "1"}).code, 0);
  const std::string first = read_text(out() / "report.html");
  ASSERT_EQ(report({"--force", "--threads", "2"}).code, 0);
  EXPECT_TRUE(first == read_text(out() / "report.html"));
}

TEST_F(ReportTool, ANameThatLooksLikeAScriptStaysAName) {
  const std::string name = "</script><script>alert('x')</script>";
  write_text(case_folder() / "case.toml",
             replaced(read_text(case_folder() / "case.toml"), "name = \"small\"", "name = \"" + name + "\""));
  ASSERT_EQ(report().code, 0);
  EXPECT_EQ(read_text(out() / "report.html").find("alert('x')</script>"), std::string::npos);
  EXPECT_EQ(data()["case"]["name"], name);
}

TEST_F(ReportTool, RefusesWithExitCode2AndWritesNothing) {
  expect_words(report({"-o", (folder_ / "report.pdf").string()}).err, {"report.pdf", ".html"});
  expect_words(report({"--dir", (folder_ / "nowhere").string()}).err, {"nowhere", "is not there", "make CASE="});
  write_text(out() / "mesh.json", "[1, 2");
  const Finished broken = report();
  EXPECT_EQ(broken.code, 2);
  expect_words(broken.err, {"mesh.json", "JSON"});
  EXPECT_FALSE(fs::exists(out() / "report.html"));
}

TEST_F(ReportTool, DoesNotReplaceAPageWithoutForce) {
  write_text(out() / "report.html", "mine");
  const Finished finished = report();
  EXPECT_EQ(finished.code, 2);
  EXPECT_EQ(read_text(out() / "report.html"), "mine");
  EXPECT_EQ(report({"--force"}).code, 0);
}

TEST_F(ReportTool, AComparisonOfAnotherPredictionIsLeftOutWithAWarning) {
  const meshing::PoseMesh was = meshing::read_pose(out() / "supine.vtu");
  Points moved = was.positions;
  moved.col(2).array() += 1;
  meshing::write_pose(was.mesh, moved, {}, {}, out() / "supine.vtu", meshing::read_side(out() / "supine.vtu"),
                      "supine");
  const Finished finished = report();
  ASSERT_EQ(finished.code, 0) << finished.err;
  expect_words(finished.err, {"comparison.vtp", "compare again"});
  EXPECT_FALSE(data()["shapes"]["states"][0]["poses"]["supine"].contains("distance_mm"));
}

TEST_F(ReportTool, WorksWithTheMeshAloneAndWithoutThe3dView) {
  for (const char* file : {"supine.vtu", "undeformed.vtu", "supine.json", "comparison.json", "comparison.vtp"})
    fs::remove(out() / file);
  ASSERT_EQ(report().code, 0);
  EXPECT_EQ(data()["answer"]["kind"], "no_shape");
  EXPECT_TRUE(data()["shapes"]["states"].empty());
  ASSERT_EQ(report({"--force", "--no-3d"}).code, 0);
  EXPECT_LT(fs::file_size(out() / "report.html"), 500000u);
}

}  // namespace
}  // namespace supine::pipeline
