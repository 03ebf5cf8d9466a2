// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/answer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/pipeline/report/measured_patient.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Answer answered(const Json& diagnosis) {
  Collected collected;
  collected.figures["supine.json"] = Json::object();
  collected.figures["calibrated/comparison.json"] = {{"rms_mm", 1.03}, {"mae_mm", 0.79}, {"noise_mm", 0.7}};
  if (!diagnosis.is_null()) collected.figures["diagnosis.json"] = diagnosis;
  return answer_of(measured_case(), collected, stages_of(measured_case(), collected, places), places);
}

TEST(ReportAnswer, NamesWhatIsMissingAndTheNextCommand) {
  const Answer answer = answered({{"verdict", "missing"},
                                  {"missing", {"gland_stiffness"}},
                                  {"base_held_out_rms_mm", 1.26},
                                  {"candidates", {{{"effect", "gland_stiffness"}, {"held_out_rms_mm", 0.95}}}}});
  EXPECT_EQ(answer.kind, "missing");
  expect_words(answer.sentence, {"gland stiffness", "0.95", "1.26"});
  EXPECT_EQ(answer.command,
            "build/bin/supine-model add gland_stiffness mycase/model.toml && make CASE=mycase calibrate");
  EXPECT_EQ(answer.error["rms_mm"], 1.03);
}

TEST(ReportAnswer, SaysWhenSkinThatWasNotFittedGainsNothing) {
  const Answer answer = answered({{"verdict", "missing"},
                                  {"missing", {"skin_prestretch"}},
                                  {"base_held_out_rms_mm", 1.49},
                                  {"candidates", {{{"effect", "skin_prestretch"}, {"held_out_rms_mm", 1.52}}}}});
  expect_words(answer.sentence, {"The model lacks skin prestretch, but", "no better", "1.52 mm, 1.49 without"});
}

TEST(ReportAnswer, SaysWhenNothingIsMissing) {
  const Answer answer = answered({{"verdict", "nothing_missing"}, {"missing", Json::array()}, {"why", "it fits"}});
  EXPECT_EQ(answer.sentence, "Nothing is missing: it fits.");
  EXPECT_EQ(answer.command, "");
}

TEST(ReportAnswer, SaysHowFarOffTheModelIsWhereTheScansWereFoundToLie) {
  Collected collected;
  collected.figures["diagnosis.json"] = {
      {"verdict", "nothing_missing"}, {"missing", Json::array()}, {"why", "it fits"}};
  collected.figures["calibration.json"] = {{"rms_mm", 0.951}, {"as_given", {{"rms_mm", 1.282}}}};
  const auto said = [&collected] {
    std::string all;
    for (const std::string& fact : answer_of(measured_case(), collected, {}, places).facts) all += fact + "\n";
    return all;
  };
  expect_words(said(), {"With the scans there", "0.95 mm off", "in place of 1.28"});
  collected.figures["calibration.json"].erase("as_given");
  EXPECT_EQ(said().find("With the scans there"), std::string::npos);
}

TEST(ReportAnswer, AnAmbiguousSetComesWithTheMeasurementThatSplitsIt) {
  const Answer answer =
      answered({{"verdict", "ambiguous"},
                {"missing", {"ligament", "adhesion", "friction"}},
                {"next_measurement",
                 {{{"measurement", "upright"}, {"separation", 24.2}, {"closest_pair", "ligament, adhesion"}}}}});
  expect_words(answer.sentence, {"ligament, adhesion or friction"});
  expect_words(answer.next, {"upright", "24"});
}

TEST(ReportAnswer, UnexplainedNamesTheClosestAsNoMoreThanThat) {
  expect_words(answered({{"verdict", "unexplained"}, {"missing", {"creep"}}}).sentence,
               {"no effect", "closest: creep"});
  const Json unlikely = {{"verdict", "unexplained"},
                         {"missing", {"creep"}},
                         {"included", {{{"effect", "creep"}, {"probability", 0.001}}}}};
  EXPECT_EQ(answered(unlikely).sentence.find("closest"), std::string::npos) << "what has no probability is not close";
}

TEST(ReportAnswer, SaysWhereSomethingLocalIsThatNoEffectLists) {
  Json unlisted = {{"probability", 0.98},
                   {"likeliest", "tissue"},
                   {"place_mm", {12, -40, 33}},
                   {"times_as_stiff", 3.9},
                   {"interval95", {2.2, 6.7}}};
  const auto facts = [&unlisted] {
    std::string all;
    for (const std::string& fact : answered({{"verdict", "unexplained"}, {"unlisted", unlisted}}).facts) all += fact;
    return all;
  };
  expect_words(facts(),
               {"no effect lists has probability 0.98", "tissue about (12, -40, 33) mm is 3.9 times as stiff"});
  const auto answer = [&unlisted] { return answered({{"verdict", "unexplained"}, {"unlisted", unlisted}}); };
  EXPECT_EQ(answer().command, "") << "it was not followed through the chain";
  unlisted["effect"] = {{"name", "local_stiffness"}, {"log_ratio", 1.3612}, {"of", "tissue"}};
  EXPECT_EQ(answer().command,
            "build/bin/supine-model add local_stiffness mycase/model.toml --with log_ratio=1.36 --with of=tissue && "
            "make CASE=mycase calibrate");
  expect_words(answer().next, {"put the local cause into the model"});
  const auto command_of = [](const char* verdict, const Json& found) {
    return answered({{"verdict", verdict}, {"missing", {"creep"}}, {"unlisted", found}}).command;
  };
  Json possible = unlisted;
  possible["probability"] = 0.4;
  expect_words(command_of("ambiguous", possible), {"add local_stiffness"});
  expect_words(command_of("missing", possible), {"add creep"});
  possible["probability"] = 0.1;
  EXPECT_EQ(command_of("ambiguous", possible), "") << "as likely as it was before";
  unlisted.erase("times_as_stiff");
  unlisted["likeliest"] = "muscle", unlisted["moved_mm"] = -4.2, unlisted["interval95"] = {-6.1, -2.3};
  expect_words(facts(), {"muscle about (12, -40, 33) mm lies 4.2 mm deeper (95 %: 2.3 to 6.1)"});
  unlisted["probability"] = 0.1;
  EXPECT_EQ(facts().find("no effect lists"), std::string::npos) << "as likely as it was before";
}

TEST(ReportAnswer, BeforeTheDiagnosisItSaysWhatToRun) {
  const Answer answer = answered(nullptr);
  EXPECT_EQ(answer.kind, "not_diagnosed");
  EXPECT_EQ(answer.command, "make CASE=mycase diagnose");
  Case no_scan = measured_case();
  no_scan.poses[1].surface.reset();
  EXPECT_EQ(answer_of(no_scan, {}, stages_of(no_scan, {}, places), places).kind, "no_shape");
}

TEST(ReportAnswer, AnErrorThatIsNoNumberIsRefused) {
  for (const Json& wrong : {Json(nullptr), Json(-1.5), Json("1")}) {
    Collected collected;
    collected.figures["comparison.json"] = {{"rms_mm", wrong}};
    expect_words(input_error([&] { answer_of(measured_case(), collected, {}, places); }),
                 {"comparison.json", "rms_mm"});
  }
}

TEST(ReportAnswer, SaysWhereAFinerMeshWouldShowMost) {
  const Answer answer = answered({{"verdict", "nothing_missing"},
                                  {"missing", Json::array()},
                                  {"finer_triangles", 1876},
                                  {"budget_mm", {{"numerical", 1.36}}}});
  ASSERT_FALSE(answer.facts.empty());
  expect_words(answer.facts.front(), {"mesh errs by 1.4 mm", "TRIANGLES=1876"});
}

}  // namespace
}  // namespace supine::pipeline
