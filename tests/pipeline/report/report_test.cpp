// SPDX-License-Identifier: AGPL-3.0-or-later
// The parts of the report that are computed before a browser sees it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "pipeline/report/answer.h"
#include "pipeline/report/collect.h"
#include "pipeline/report/encode.h"
#include "pipeline/report/page.h"
#include "pipeline/report/polydata.h"
#include "pipeline/report/slices.h"
#include "pipeline/report/stages.h"
#include "tests/pipeline/report/measured_patient.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;

std::string encoded(std::string_view text) { return base64(std::as_bytes(std::span(text.data(), text.size()))); }

TEST(ReportEncode, Base64IsThatOfTheStandard) {  // RFC 4648, section 10
  EXPECT_EQ(encoded(""), "");
  EXPECT_EQ(encoded("f"), "Zg==");
  EXPECT_EQ(encoded("fo"), "Zm8=");
  EXPECT_EQ(encoded("foobar"), "Zm9vYmFy");
}

TEST(ReportEncode, LongBase64IsThatOfItsPiecesJoined) {
  const std::string piece(3 << 20, 'x'), more = piece + "foobar";
  EXPECT_EQ(encoded(more), encoded(piece) + "Zm9vYmFy");
}

TEST(ReportEncode, NumbersAreLittleEndianAndRowByRow) {
  Points points(1, 3);
  points << 1, -2, 0.5;
  EXPECT_EQ(base64_floats(points), "AACAPwAAAMAAAAA/");
  Triangles triangles(1, 3);
  triangles << 0, 1, 258;
  EXPECT_EQ(base64_indices(triangles), "AAAAAAEAAAACAQAA");
}

TEST(ReportEncode, AStringCannotEndTheScriptItStandsIn) {
  const Json json = {{"name", "</script><script>alert(1)</script><!-- & \xE2\x80\xA8"}};
  const std::string text = json_for_script(json);
  for (const char* bad : {"<", ">", "&", "\xE2\x80\xA8"}) EXPECT_EQ(text.find(bad), std::string::npos) << text;
  EXPECT_EQ(Json::parse(text), json);
}

TEST(ReportEncode, BytesThatAreNoTextBecomeTheReplacementCharacter) {
  EXPECT_EQ(json_for_script(Json("a\xFF")), "\"a\xEF\xBF\xBD\"");
}

TEST(ReportEncode, HtmlIsEscapedBetweenTagsAndInQuotes) {
  EXPECT_EQ(escape_html("<a href='x'>\"&\"</a>"), "&lt;a href=&#39;x&#39;&gt;&quot;&amp;&quot;&lt;/a&gt;");
}

TEST(ReportSlices, AreTheVolumeOnAnUprightGridOfAtMostSoManyVoxels) {
  // Values rise linearly along the patient's x; the volume lies turned and is anisotropic.
  segmentation::GreyImage volume;
  volume.grid.size = {30, 24, 20};
  volume.grid.spacing_mm = {1, 1.5, 2};
  volume.grid.origin_mm = {-10, 5, -12};
  volume.grid.direction = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 30; ++i)
        volume.voxels.push_back(static_cast<float>(100 + 3 * volume.grid.point(Eigen::Vector3d(i, j, k)).x()));
  const Eigen::Vector3d low(-6, 14, -8), high(6, 26, 12);
  const GreyBytes fine = grey_bytes(volume, low, high, 1e6), coarse = grey_bytes(volume, low, high, 300);
  EXPECT_EQ(fine.grid.spacing_mm, Eigen::Vector3d::Ones());
  EXPECT_LE(coarse.grid.count(), 300U);
  EXPECT_GT(coarse.grid.count(), 150U);
  for (const GreyBytes* bytes : {&fine, &coarse}) {
    ASSERT_EQ(bytes->voxels.size(), bytes->grid.count());
    const double step = (bytes->white - bytes->black) / 255;
    int within = 0;
    for (int i = 0; i < bytes->grid.size.x(); ++i) {
      const double value = 100 + 3 * bytes->grid.point(Eigen::Vector3d(i, 1, 1)).x();
      if (value < bytes->black || value > bytes->white) continue;
      EXPECT_NEAR(bytes->black + step * bytes->voxels[bytes->grid.index(i, 1, 1)], value, 0.51 * step + 1e-3);
      ++within;
    }
    EXPECT_GE(within, bytes->grid.size.x() - 2);
  }
}

const PageAssets assets = {"<t>@TITLE@</t>@STYLE@|@DATA@|@SCRIPT@|@VIEW3D@.", "p{}", "a='</script>'", "b='<!--'"};

TEST(ReportPage, HoldsEverythingInItsPlace) {
  EXPECT_EQ(render_page(assets, "A & B", {{"x", 1}}), "<t>A &amp; B</t>p{}|{\"x\":1}|a='<\\/script>'|b='<\\!--'.");
}

TEST(ReportPage, AMarkInTheDataIsNotFilledIn) {
  EXPECT_NE(render_page(assets, "@SCRIPT@", {}).find("<t>@SCRIPT@</t>"), std::string::npos);
}

TEST(ReportPage, AFrameWithoutAMarkIsRefused) {
  PageAssets broken = assets;
  broken.frame = "@TITLE@ @STYLE@ @SCRIPT@ @VIEW3D@";
  expect_words(input_error([&] { render_page(broken, "", {}); }), {"@DATA@"});
}

/// A ball of about 2 n² triangles.
std::pair<Points, Triangles> ball(int n) {
  Points points(n * n, 3);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double a = M_PI * (i + 0.5) / n, b = 2 * M_PI * j / n;
      points.row(n * i + j) << 50 * std::sin(a) * std::cos(b), 50 * std::sin(a) * std::sin(b), 50 * std::cos(a);
    }
  Triangles triangles(2 * (n - 1) * n, 3);
  for (int i = 0, t = 0; i + 1 < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int a = n * i + j, b = n * i + (j + 1) % n;
      triangles.row(t++) << a, a + n, b;
      triangles.row(t++) << b, a + n, b + n;
    }
  return {points, triangles};
}

TEST(ReportThinning, KeepsSomeOfThePointsAndTheShape) {
  const auto [points, triangles] = ball(80);
  const Thinned thin = thin_out(points, triangles, 2000);
  EXPECT_LE(thin.triangles.rows(), 2100);
  EXPECT_GT(thin.triangles.rows(), 1000);
  EXPECT_TRUE(std::is_sorted(thin.points.begin(), thin.points.end()));
  double area = 0;
  for (const auto& t : thin.triangles.rowwise()) {
    const Eigen::Vector3d a = points.row(thin.points[t[0]]), b = points.row(thin.points[t[1]]),
                          c = points.row(thin.points[t[2]]);
    area += (b - a).cross(c - a).norm() / 2;
  }
  EXPECT_NEAR(area, 4 * M_PI * 50 * 50, 0.03 * 4 * M_PI * 50 * 50);
}

TEST(ReportThinning, LeavesASmallSurfaceAsItIs) {
  const auto [points, triangles] = ball(10);
  const Thinned thin = thin_out(points, triangles, 1000);
  EXPECT_EQ(thin.triangles, triangles);
  EXPECT_EQ(thin.points.size(), static_cast<std::size_t>(points.rows()));
}

TEST(ReportThinning, TakesEveryNthOfBarePoints) {
  const Thinned thin = thin_out(Points::Zero(1000, 3), Triangles(0, 3), 300);
  EXPECT_EQ(thin.points.size(), 250u);
  EXPECT_EQ(thin.points[1], 4);
}

TEST(ReportPolydata, SaysWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  write_text(folder / "a.vtp", "this is no XML");
  expect_words(input_error([&] { read_polydata(folder / "a.vtp"); }), {"a.vtp", "not a readable .vtp file"});
  expect_words(input_error([&] { read_polydata(folder / "b.vtp"); }), {"b.vtp", "no such file"});
}

const Stage& stage(const std::vector<Stage>& stages, const std::string& name) {
  return *std::find_if(stages.begin(), stages.end(), [&](const Stage& s) { return s.name == name; });
}

TEST(ReportStages, WhatHasNotRunIsNamedWithItsCommand) {
  Collected collected;
  collected.figures["labels.json"] = Json::object();
  const auto stages = stages_of(measured_case(), collected, places);
  EXPECT_EQ(stage(stages, "segment").fill, "");
  EXPECT_EQ(stage(stages, "simulate").fill, "make CASE=mycase simulate");
  EXPECT_EQ(stage(stages, "diagnose").fill, "make CASE=mycase diagnose");
  EXPECT_NE(stage(stages, "sensitivity").fill.find("supine-sensitivity mycase mycase/out/mesh.vtu"), std::string::npos);
  Places elsewhere = places;
  elsewhere.out_name = "/data/out";
  EXPECT_EQ(stage(stages_of(measured_case(), collected, elsewhere), "mesh").fill,
            "make CASE=mycase OUT=/data/out mesh");
}

TEST(ReportStages, WithoutAScanWhatNeedsOneSaysSo) {
  Case measured = measured_case();
  measured.poses[1].surface.reset();
  const auto stages = stages_of(measured, {}, places);
  for (const char* name : {"compare", "calibrate", "diagnose", "ladder"})
    EXPECT_NE(stage(stages, name).fill.find("measured surface"), std::string::npos) << name;
  EXPECT_EQ(stage(stages, "mesh").fill, "make CASE=mycase mesh");
}

TEST(ReportStages, TheCommandIsThatOfTheProvenance) {
  Collected collected;
  collected.figures["coarse.json"]["provenance"] = {
      {"tool", "supine-decimate"},
      {"options", {{"surface", "breast.vtp"}, {"triangles", 2500}, {"open", false}, {"finer", "[]"}}}};
  collected.figures["diagnosis.json"]["provenance"] = {
      {"tool", "supine-diagnose"}, {"options", {{"mesh", "mesh.vtu"}, {"model", "model.toml"}, {"ladder", true}}}};
  const auto stages = stages_of(measured_case(), collected, places);
  EXPECT_EQ(stage(stages, "decimate").command,
            "supine-decimate mycase/out/breast.vtp --triangles 2500 -o mycase/out/coarse.vtp --force");
  EXPECT_EQ(stage(stages, "diagnose").command,
            "supine-diagnose mycase mycase/out/mesh.vtu --model mycase/out/model.toml --ladder -o mycase/out --force");
}

TEST(ReportStages, AnInputThatWasWrittenAgainMakesItsResultStale) {
  const TemporaryFolder folder;
  write_text(folder / "out/mesh.vtu", "abc");
  const std::string hash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";  // of "abc", FIPS 180-2
  Collected collected;
  collected.figures["supine.json"]["provenance"] = {{"tool", "supine-simulate"},
                                                    {"inputs", {{{"file", "mesh.vtu"}, {"sha256", hash}}}}};
  const Places here = {folder.path(), folder / "out", "c", "c/out"};
  EXPECT_EQ(stage(stages_of(measured_case(), collected, here), "simulate").stale, "");
  write_text(folder / "out/mesh.vtu", "abcd");
  expect_words(stage(stages_of(measured_case(), collected, here), "simulate").stale, {"supine.json", "mesh.vtu"});
}

TEST(ReportStages, LandmarksThatWereMeasuredMayBeCalledAsThoseThatArePredicted) {
  const TemporaryFolder folder;
  const std::string of_abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",  // FIPS 180-2
      of_nothing = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
  write_text(folder / "supine_landmarks.csv", "abc");
  write_text(folder / "out/supine_landmarks.csv", "");
  Case measured = measured_case();
  measured.poses[1].landmarks = folder / "supine_landmarks.csv";
  Collected collected;
  collected.figures["comparison.json"]["provenance"] = {{"tool", "supine-compare"},
                                                        {"inputs",
                                                         {{{"file", "supine_landmarks.csv"}, {"sha256", of_abc}},
                                                          {{"file", "supine_landmarks.csv"}, {"sha256", of_nothing}}}}};
  const Places here = {folder.path(), folder / "out", "c", "c/out"};
  EXPECT_EQ(stage(stages_of(measured, collected, here), "compare").stale, "");
  write_text(folder / "out/supine_landmarks.csv", "predicted anew");
  expect_words(stage(stages_of(measured, collected, here), "compare").stale,
               {"comparison.json", "another supine_landmarks.csv"});
}

TEST(ReportStages, AScanThatWasMovedSinceAndAnotherGravityMakeStaleToo) {
  const TemporaryFolder folder;
  write_text(folder / "supine.ply", "abcd");
  const std::string hash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";  // of "abc", FIPS 180-2
  Case measured = measured_case();
  measured.poses[1].surface = folder / "supine.ply";
  Collected collected;
  collected.figures["diagnosis.json"] = {
      {"verdict", "nothing_missing"}, {"missing", Json::array()}, {"why", "it fits"}};
  collected.figures["diagnosis.json"]["provenance"] = {{"tool", "supine-diagnose"},
                                                       {"inputs", {{{"file", "supine.ply"}, {"sha256", hash}}}}};
  collected.figures["supine.json"]["gravity"] = {0, 0.8, 0.6};
  const Places here = {folder.path(), folder / "out", "c", "c/out"};
  const auto stages = stages_of(measured, collected, here);
  expect_words(stage(stages, "diagnose").stale, {"diagnosis.json", "another supine.ply"});
  expect_words(stage(stages, "simulate").stale, {"supine.json", "another gravity", "[pose.supine]"});
  const Answer answer = answer_of(measured, collected, stages, here);
  expect_words(answer.sentence, {"Out of date", "another supine.ply", "Nothing is missing"});
  EXPECT_EQ(answer.command, "make CASE=c diagnose");
}

TEST(ReportCollect, DropsTimingAndRefusesWhatIsNoJson) {
  const TemporaryFolder folder;
  write_text(folder / "out/mesh.json", R"({"cells": 7, "timing": {"total_s": 1.5}})");
  write_text(folder / "out/report.json", "not looked at");
  EXPECT_EQ(collect(measured_case(), folder.path(), folder / "out").find("mesh.json"), Json({{"cells", 7}}));
  write_text(folder / "out/supine.json", "{\"cut\": ");
  expect_words(input_error([&] { collect(measured_case(), folder.path(), folder / "out"); }), {"supine.json", "JSON"});
}

}  // namespace
}  // namespace supine::pipeline
