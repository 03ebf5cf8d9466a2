// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case.h"

#include <fmt/core.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "pipeline/case/case_priors.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

using segmentation::Tissue;

const std::string good = R"([case]
name = "phantom"
frame = "LPS"
side = "left"

[image]
file = "labels.nrrd"
kind = "labels"
cut = ["excluded", "rim"]
rim_mm = 8
[image.labels]
air = [0]
adipose = [1]
gland = [29, 95, 125]
muscle = [40]

[pose.prone]
gravity = [0.0, -1.0, 0.0]
[pose.tilt45]
gravity = [0.0, 0.6, -0.8]
[pose.supine]
gravity = [0.6, 0.8, 0.0]
surface = "supine.ply"
noise_mm = 0.7
landmarks = "supine_landmarks.csv"

[landmarks]
prone = "prone_landmarks.csv"
[calibration]
poses = ["supine"]
)";

class CaseFile : public testing::Test {
 protected:
  CaseFile() {
    for (const char* name : {"labels.nrrd", "supine.ply", "supine_landmarks.csv", "prone_landmarks.csv"})
      write_text(folder_ / name, name);
  }
  Case read(const std::string& text) {
    write_text(folder_ / "case.toml", text);
    return read_case(folder_.path());
  }
  /// What is said about the good case with @p from replaced by @p to.
  std::string complaint(const std::string& from, const std::string& to) {
    return input_error([&] { read(replaced(good, from, to)); });
  }
  TemporaryFolder folder_;
};

TEST_F(CaseFile, SaysWhatAScanIsLaidOn) {
  EXPECT_TRUE(read(good).register_on.on.empty());
  const Case c = read(replaced(good, "[calibration]",
                               "[register]\non = [\"support\", \"landmarks\"]\nrigid = [\"sternum\"]\n[calibration]"));
  EXPECT_EQ(c.register_on.on, (std::vector<std::string>{"support", "landmarks"}));
  EXPECT_EQ(c.register_on.rigid, std::vector<std::string>{"sternum"});
}

TEST_F(CaseFile, SaysHowWellMeasurementsAreKnown) {
  std::string text = replaced(good, "noise_mm = 0.7",
                              "noise_mm = 0.7\nregistration_mm = 0.4\ngravity_deg = 1\nbreath_mm = 0.5\n"
                              "noise_shared_mm = 0.1\nindependent_points = 60");
  text = replaced(text, "gravity = [0.0, 0.6, -0.8]", "gravity = [0.0, 0.6, -0.8]\nregistration_deg = 3");
  const Case c = read(replaced(text, "rim_mm = 8", "rim_mm = 8\nsegmentation_mm = 0.2"));
  constexpr double degree = std::numbers::pi / 180;
  const diagnosis::Priors priors = case_priors(c, {}), defaults;
  const simulation::MeasurementTolerances supine = priors.known_in("supine"), tilt = priors.known_in("tilt45");
  EXPECT_EQ(supine.registration_mm, 0.4);
  EXPECT_DOUBLE_EQ(supine.registration_rad, 0.3 * degree) << "goes with the shift";
  EXPECT_DOUBLE_EQ(supine.gravity_rad, degree);
  EXPECT_EQ(supine.chest_wall_mm, 0.5);
  EXPECT_EQ(priors.scan_shared_in("supine"), 0.1);
  EXPECT_EQ(tilt.registration_mm, defaults.known.registration_mm);
  EXPECT_DOUBLE_EQ(tilt.registration_rad, 3 * degree);
  EXPECT_EQ(tilt.gravity_rad, defaults.known.gravity_rad);
  EXPECT_EQ(priors.scan_shared_in("tilt45"), defaults.scan_shared_mm);
  EXPECT_EQ(priors.independent_points_in("supine"), 60);
  EXPECT_FALSE(priors.independent_points_in("tilt45"));
  EXPECT_EQ(priors.known.segmentation_mm, 0.2);
  const diagnosis::Priors said = case_priors(c, {.registration_mm = 1, .segmentation_mm = 0.6, .chest_wall_mm = 2});
  for (const char* pose : {"supine", "tilt45"}) {
    EXPECT_EQ(said.known_in(pose).registration_mm, 1) << "the command line overrules the case";
    EXPECT_DOUBLE_EQ(said.known_in(pose).registration_rad, 0.75 * degree);
    EXPECT_EQ(said.known_in(pose).chest_wall_mm, 2);
  }
  EXPECT_EQ(said.known.segmentation_mm, 0.6);
}

TEST_F(CaseFile, EveryKeyArrives) {
  const Case c = read(good);
  EXPECT_EQ(c.name, "phantom");
  EXPECT_EQ(c.side, "left");
  EXPECT_EQ(c.image_kind, "labels");
  EXPECT_TRUE(c.cut.excluded);
  EXPECT_FALSE(c.cut.edge);
  EXPECT_TRUE(c.cut.rim);
  EXPECT_EQ(c.cut.rim_mm, 8);
  EXPECT_EQ(c.labels.size(), 6u);
  EXPECT_EQ(c.labels.at(95), Tissue::gland);
  EXPECT_EQ(c.image_file, folder_ / "labels.nrrd");
  EXPECT_EQ(c.prone_landmarks, folder_ / "prone_landmarks.csv");
  EXPECT_EQ(c.pose("supine").noise_mm, 0.7);
  EXPECT_EQ(c.pose("supine").surface, folder_ / "supine.ply");
  EXPECT_FALSE(c.pose("tilt45").surface);
}

TEST_F(CaseFile, ProneComesFirstAndSupineSecond) {
  const Case c = read(good);
  ASSERT_EQ(c.poses.size(), 3u);
  EXPECT_EQ(c.poses[0].name, "prone");
  EXPECT_EQ(c.poses[1].name, "supine");
  EXPECT_EQ(c.poses[2].name, "tilt45");
}

TEST_F(CaseFile, FurtherPosesKeepTheOrderOfTheFile) {
  const Case c = read(good + "[pose.upright]\ngravity = [0, 0, -1]\n[pose.a_side]\ngravity = [1, 0, 0]\n");
  ASSERT_EQ(c.poses.size(), 5u);
  EXPECT_EQ(c.poses[2].name, "tilt45");
  EXPECT_EQ(c.poses[3].name, "upright");
  EXPECT_EQ(c.poses[4].name, "a_side");
}

TEST_F(CaseFile, GravityInRasBecomesLps) {
  const Case c = read(replaced(good, "frame = \"LPS\"", "frame = \"RAS\""));
  EXPECT_TRUE(c.pose("supine").gravity.isApprox(Eigen::Vector3d(-0.6, -0.8, 0.0), 1e-12));
  EXPECT_TRUE(c.pose("tilt45").gravity.isApprox(Eigen::Vector3d(0.0, -0.6, -0.8), 1e-12));
}

TEST_F(CaseFile, GravityWithinTheToleranceIsNormalised) {
  const Case c = read(replaced(good, "[0.6, 0.8, 0.0]", "[0.6004, 0.8004, 0.0]"));
  EXPECT_NEAR(c.pose("supine").gravity.norm(), 1, 1e-15);
}

TEST_F(CaseFile, TheSharedCasesAreRead) {
  const std::filesystem::path shared = std::filesystem::path(SUPINE_SHARED_DATA) / "hidden-open" / "ligament-1";
  if (!std::filesystem::exists(shared)) GTEST_SKIP() << "shared data not there: " << shared;
  const Case c = read_case(shared);
  EXPECT_EQ(c.poses.size(), 3u);
  EXPECT_TRUE(c.cut.excluded);
}

TEST_F(CaseFile, TheSamplesAreRead) {
  for (const char* name : {"ligament", "phantom"})
    EXPECT_EQ(read_case(std::filesystem::path(SUPINE_SOURCE_DIR) / "samples" / name).name, name);
}

struct BadCase {
  const char *name, *from, *to;
  std::vector<std::string> words;
};

void PrintTo(const BadCase& bad, std::ostream* out) { *out << bad.from << " -> " << bad.to; }

class BadCaseFile : public CaseFile, public testing::WithParamInterface<BadCase> {};

TEST_P(BadCaseFile, IsRefusedWithPlaceValueAndBound) {
  const std::string message = complaint(GetParam().from, GetParam().to);
  expect_words(message, {"case.toml"});
  expect_words(message, GetParam().words);
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadCaseFile,
    testing::Values(
        BadCase{"NotToml", "[case]", "[case", {":1:", "not valid TOML"}},
        BadCase{"UnknownKey", "side =", "sied =", {":4", "[case] sied", "unknown key", "did you mean side?"}},
        BadCase{"UnknownFrame",
                "kind = \"labels\"",
                "kind = \"labels\"\nframe = \"ALP\"",
                {":9", "[image] frame", "ALP", "three letters"}},
        BadCase{"UnknownTable", "[landmarks]", "[landmark]", {"landmark:", "did you mean landmarks?"}},
        BadCase{"KeyTwice", "name = \"phantom\"", "name = \"a\"\nname = \"b\"", {":3"}},
        BadCase{"NoName", "name = \"phantom\"", "", {"[case] name", "missing"}},
        BadCase{"NoSide", "side = \"left\"", "", {"[case] side", "missing"}},
        BadCase{"WrongSide", "\"left\"", "\"lefft\"", {":4", "\"lefft\"", "left, right or both", "did you mean left?"}},
        BadCase{"WrongFrame", "\"LPS\"", "\"LPI\"", {"frame", "LPI", "LPS or RAS"}},
        BadCase{"NameIsANumber", "\"phantom\"", "7", {"name = 7", "text in quotes"}},
        BadCase{"NoImage",
                "[image]\nfile = \"labels.nrrd\"\nkind = \"labels\"\ncut = [\"excluded\", \"rim\"]\nrim_mm = "
                "8\n[image.labels]\nair = [0]\nadipose = [1]\ngland = [29, 95, 125]\nmuscle = [40]\n",
                "",
                {"[image]", "missing"}},
        BadCase{"ImageNotThere",
                "file = \"labels.nrrd\"",
                "file = \"volume.nrrd\"",
                {":7", "file = \"volume.nrrd\"", "is not there"}},
        BadCase{"UnknownKind", "kind = \"labels\"", "kind = \"ct\"", {"kind = \"ct\"", "labels, mri or surface"}},
        BadCase{"NoLabels",
                "[image.labels]\nair = [0]\nadipose = [1]\ngland = [29, 95, 125]\nmuscle = [40]\n",
                "",
                {"[image.labels]", "missing"}},
        BadCase{"UnknownTissue", "adipose =", "adpose =", {"[image.labels] adpose", "did you mean adipose?"}},
        BadCase{"LabelTwice", "[29, 95, 125]", "[29, 40, 1]", {"label value 1", "adipose"}},
        BadCase{"EmptyLabel", "[29, 95, 125]", "[]", {"gland", "lists no label value"}},
        BadCase{"LabelIsNotWhole", "[29, 95, 125]", "[29.5]", {"gland", "whole numbers"}},
        BadCase{"LabelIsNoList", "muscle = [40]", "muscle = 40", {"muscle = 40", "list"}},
        BadCase{"NoMuscle", "muscle = [40]", "", {"muscle", "missing"}},
        BadCase{"NoSoftTissue", "adipose = [1]\ngland = [29, 95, 125]", "", {"soft tissue"}},
        BadCase{"UnknownCut", "\"excluded\", \"rim\"", "\"excluded\", \"edges\"", {"edges", "excluded, edge or rim"}},
        BadCase{"RimWithoutRim", "\"excluded\", \"rim\"", "\"excluded\"", {"rim_mm = 8", "no effect"}},
        BadCase{"RimNotPositive", "rim_mm = 8", "rim_mm = 0", {"rim_mm = 0", "> 0 mm"}},
        BadCase{"RecipeForLabels", "[landmarks]", "[segmentation]\n[landmarks]", {"segmentation", "kind"}},
        BadCase{"GravityZero", "[0.6, 0.8, 0.0]", "[0, 0, 0]", {"[pose.supine] gravity", "is zero"}},
        BadCase{"GravityNotUnit",
                "[0.6, 0.8, 0.0]",
                "[0.0, 9.81, 0.0]",
                {"[pose.supine]", "length 1", "9.81", "[0.000000, 1.000000, 0.000000]"}},
        BadCase{"GravityTwoNumbers", "[0.6, 0.8, 0.0]", "[0.6, 0.8]", {"three numbers"}},
        BadCase{"GravityNotANumber", "[0.6, 0.8, 0.0]", "[0.6, 0.8, nan]", {"gravity", "finite"}},
        BadCase{"GravityMissing", "gravity = [0.6, 0.8, 0.0]\n", "", {"[pose.supine] gravity", "missing"}},
        BadCase{"GravityTheSame",
                "[0.6, 0.8, 0.0]",
                "[0.0, -1.0, 0.0001]",
                {"[pose.supine]", "same direction", "[pose.prone]"}},
        BadCase{"NoSupine", "[pose.supine]", "[pose.lying]", {"[pose.supine]", "missing"}},
        BadCase{"PoseWithSlash", "[pose.tilt45]", "[pose.\"../tilt\"]", {"../tilt", "letters"}},
        BadCase{"PoseNamedLikeAFile", "[pose.tilt45]", "[pose.undeformed]", {"undeformed", "another"}},
        BadCase{"ScanNotThere", "\"supine.ply\"", "\"scan.ply\"", {"surface = \"scan.ply\"", "is not there"}},
        BadCase{"ScanIsAFolder", "\"supine.ply\"", "\".\"", {"is a folder"}},
        BadCase{"KnownNegative", "noise_mm = 0.7", "noise_mm = 0.7\nbreath_mm = -1", {"breath_mm = -1", "0 to 30"}},
        BadCase{"KnownTooLarge",
                "noise_mm = 0.7",
                "noise_mm = 0.7\nregistration_deg = 90",
                {"registration_deg = 90", "0 to 45"}},
        BadCase{"KnownOfImagedPose",
                "gravity = [0.0, -1.0, 0.0]",
                "gravity = [0.0, -1.0, 0.0]\nregistration_mm = 1",
                {"registration_mm = 1", "[pose.prone]"}},
        BadCase{"SegmentationTooLarge",
                "rim_mm = 8",
                "rim_mm = 8\nsegmentation_mm = 11",
                {"segmentation_mm = 11", "0 to 10"}},
        BadCase{"NoiseNotPositive", "noise_mm = 0.7", "noise_mm = -0.7", {"noise_mm = -0.7", "> 0 mm"}},
        BadCase{"LandmarksWithoutProne", "prone = \"prone_landmarks.csv\"", "", {"[pose.supine] landmarks", "prone"}},
        BadCase{"RegisterOnUnknown",
                "[calibration]",
                "[register]\non = [\"skin\"]\n[calibration]",
                {"[register]", "\"skin\" is none of landmarks, model or support"}},
        BadCase{"CalibratedPoseUnknown", "poses = [\"supine\"]", "poses = [\"upright\"]", {"poses", "[pose.upright]"}},
        BadCase{"CalibratedPoseHasNoScan",
                "poses = [\"supine\"]",
                "poses = [\"tilt45\"]",
                {"[pose.tilt45]", "no surface"}}),
    [](const auto& place) { return place.param.name; });

TEST_F(CaseFile, NamesSupportsOfALabelMap) {
  EXPECT_TRUE(read(good).label_supports.empty());
  const Case c = read(replaced(good, "muscle = [40]", "muscle = [40]\nsupport.port = [41, 42]\nsupport.arm = [7]"));
  EXPECT_EQ(c.labels.at(42), Tissue::muscle);
  ASSERT_EQ(c.label_supports.size(), 3u);
  EXPECT_EQ(c.label_supports[0].name, "muscle");
  EXPECT_EQ(c.label_supports[1].name, "port") << "in the order of the file";
  EXPECT_EQ(c.label_supports[1].values, (std::vector<int>{41, 42}));
  EXPECT_EQ(c.label_supports[2].name, "arm");
  const Case without = read(replaced(good, "muscle = [40]", "support = { port = [40] }"));
  ASSERT_EQ(without.label_supports.size(), 1u);
  EXPECT_EQ(without.label_supports[0].name, "port");
}

TEST_F(CaseFile, RefusesSupportsOfALabelMapThatCannotBeMeant) {
  const auto said = [&](const std::string& lines) { return complaint("muscle = [40]", lines); };
  expect_words(said("support.a = [40]\nsupport.a = [41]"), {"case.toml:16", "not valid TOML"});
  expect_words(said("muscle = [40]\nsupport.muscle = [41]"), {"[image.labels.support] muscle", "second support"});
  expect_words(said("support.a = [40]\nsupport.b = [41, 40]"), {"b = [41, 40]", "label value 40", "for a"});
  expect_words(said("support.a = [1]"), {"label value 1", "for adipose"});
  expect_words(said("support.a = []"), {"[image.labels.support] a", "lists no label value"});
  expect_words(said("support.\"a b\" = [40]"), {"a b", "letters, digits and _"});
  const std::string mri = replaced(replaced(good, "kind = \"labels\"", "kind = \"mri\""), "muscle = [40]",
                                   "muscle = [40]\nsupport.port = [41]");
  expect_words(input_error([&] { read(mri); }), {"[image.labels] support", "label map"});
}

const std::string bar = R"([case]
name = "bar"
body = "object"
[image]
file = "bar.stl"
kind = "surface"
pose = "undeformed"
[image.supports.clamp]
point = [0, 0, 0]
normal = [2, 0, 0]
[image.supports.a_box]
point = [10, 0, 0]
normal = [0, 1, 0]
faces = "beyond"
[image.parts.tip]
file = "bar.stl"
[pose.hanging]
gravity = [0, -1, 0]
surface = "bar.stl"
[pose.floating]
gravity = [0, 0, 0]
surface = "bar.stl"
)";

class ObjectCase : public CaseFile {
 protected:
  ObjectCase() { write_text(folder_ / "bar.stl", "x"); }
};

TEST_F(ObjectCase, NeedsNeitherSideNorProneNorSupine) {
  const Case c = read(bar);
  EXPECT_TRUE(c.is_object());
  EXPECT_EQ(c.side, "none");
  EXPECT_EQ(c.imaged().name, "undeformed");
  EXPECT_TRUE(c.imaged().gravity.isZero(0));
  ASSERT_EQ(c.poses.size(), 3u);
  EXPECT_EQ(c.poses[1].name, "hanging");
  EXPECT_EQ(c.calibrated_poses, (std::vector<std::string>{"hanging", "floating"}));
  ASSERT_EQ(c.supports.size(), 2u);
  EXPECT_EQ(c.supports[0].name, "clamp") << "in the order of the file";
  EXPECT_EQ(c.supports[0].normal, Eigen::Vector3d(1, 0, 0));
  EXPECT_TRUE(c.supports[1].beyond);
  EXPECT_EQ(c.parts.at(0).file, folder_ / "bar.stl");
}

TEST_F(ObjectCase, WhatCannotBeMeantIsRefused) {
  const auto complaint_of = [&](const std::string& from, const std::string& to) {
    return input_error([&] { read(replaced(bar, from, to)); });
  };
  expect_words(complaint_of("body = \"object\"", "body = \"object\"\nside = \"left\""),
               {"[case] side", "leave it out"});
  expect_words(complaint_of("pose = \"undeformed\"\n", ""), {"[image] pose", "missing"});
  expect_words(complaint_of("pose = \"undeformed\"", "pose = \"lying\""), {"[pose.lying]", "missing"});
  expect_words(complaint_of("[image.supports.a_box]", "[image.supports.clamp]"), {"clamp"});
  expect_words(complaint_of("file = \"bar.stl\"\n[pose", "file = \"bar.stl\"\npoint = [0, 0, 0]\n[pose"),
               {"[image.parts.tip] point", "one of the two"});
  expect_words(complaint_of("normal = [2, 0, 0]\n", ""), {"normal", "missing"});
  expect_words(complaint_of("normal = [2, 0, 0]", "normal = [0, 0, 0]"), {"normal", "is zero"});
  expect_words(
      complaint_of("[image.supports.clamp]\npoint = [0, 0, 0]\nnormal = [2, 0, 0]\n[image.supports.a_box]\npoint = "
                   "[10, 0, 0]\nnormal = [0, 1, 0]\nfaces = \"beyond\"\n",
                   ""),
      {"[image] supports", "nothing holds the body"});
  expect_words(complaint_of("gravity = [0, -1, 0]\nsurface = \"bar.stl\"", "gravity = [0, 0, 0]"), {"is zero"});
}

TEST_F(CaseFile, AnotherImagedPoseStandsInForProne) {
  const Case c = read(replaced(replaced(replaced(good, "kind = \"labels\"", "kind = \"labels\"\npose = \"tilt45\""),
                                        "[pose.prone]\ngravity = [0.0, -1.0, 0.0]\n", ""),
                               "prone = \"prone_landmarks.csv\"", "tilt45 = \"prone_landmarks.csv\""));
  EXPECT_EQ(c.imaged().name, "tilt45");
  EXPECT_EQ(c.poses[1].name, "supine");
  EXPECT_TRUE(c.prone_landmarks);
}

TEST_F(CaseFile, AFolderThatIsNotThereIsNamed) {
  expect_words(input_error([] { read_case("/no/such/case"); }), {"/no/such/case", "not there"});
}

TEST_F(CaseFile, AFolderWithoutCaseFileIsNamed) {
  expect_words(input_error([&] { read_case(folder_.path()); }), {"case.toml", "is not there"});
}

TEST_F(CaseFile, AFileInsteadOfAFolderIsNamed) {
  expect_words(input_error([&] { read_case(folder_ / "labels.nrrd"); }), {"labels.nrrd", "not a folder"});
}

TEST_F(CaseFile, AComplaintAboutTheRecipeNamesCaseTomlAndTheLine) {
  const std::string recipe = "[[segmentation.step]]\ndo = \"islads\"\n[landmarks]";
  const std::string text = replaced(replaced(good, "kind = \"labels\"", "kind = \"mri\""), "[landmarks]", recipe);
  const auto line = 2 + std::count(text.begin(), text.begin() + static_cast<long>(text.find(recipe)), '\n');
  expect_words(input_error([&] { read(text); }),
               {fmt::format("case.toml:{}: [segmentation.step 1] do", line), "\"islads\"", "did you mean islands?"});
}

TEST_F(CaseFile, AnUnknownPoseListsThoseThereAre) {
  const Case c = read(good);
  expect_words(input_error([&] { c.pose("upright"); }), {"upright", "prone, supine or tilt45"});
}

}  // namespace
}  // namespace supine::pipeline
