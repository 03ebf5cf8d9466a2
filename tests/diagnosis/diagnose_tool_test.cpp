// SPDX-License-Identifier: AGPL-3.0-or-later
// What the built tool tells beside its answer, on the run that the tests of the pipeline share.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/pipeline/process.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class DiagnoseTool : public testing::Test {
 protected:
  void SetUp() override { run_process({"cp", "-a", small_run().string(), case_.string()}); }

  Finished diagnose(const std::vector<std::string>& more) const { return diagnose(case_ / "model.toml", more); }

  Finished diagnose(const fs::path& model, const std::vector<std::string>& more) const {
    std::vector<std::string> words = {tool("diagnose"), case_.string(), (case_ / "out/mesh.vtu").string(),
                                      "--model",        model.string(), "-o",
                                      found_.string(),  "--refit",      "0"};
    words.insert(words.end(), more.begin(), more.end());
    return run_process(words);
  }

  TemporaryFolder folder_;
  fs::path case_ = folder_ / "case", found_ = folder_ / "found";
};

TEST_F(DiagnoseTool, TellsEveryStepItBegins) {
  const Finished finished = diagnose({});
  ASSERT_EQ(finished.code, 0) << finished.err;
  std::size_t before = 0;
  for (const char* step : {"errors of mesh and body", "fit with all that is never known", "catalogue", "evidence"}) {
    const std::size_t at = finished.out.find(std::string("\n  ") + step + "\n");
    ASSERT_NE(at, std::string::npos) << step << " is not in:\n" << finished.out;
    EXPECT_GT(at, before) << step;
    before = at;
  }
}

TEST_F(DiagnoseTool, BeginsStifferWhereTheCalibratedModelCarriesNoMore) {
  const fs::path soft = case_ / "soft.toml";
  const std::string text = read_text(case_ / "model.toml"), stiff = "value = 2.0, prior_sd = 1.0, lower = 0.1";
  ASSERT_NE(text.find(stiff), std::string::npos) << text;
  write_text(soft, replaced(text, stiff, "value = 0.02, prior_sd = 1.0, lower = 0.01"));
  const Finished finished = diagnose(soft, {"--no-other-meshes"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.err.find("is where the search begins"), std::string::npos) << finished.err;
}

TEST_F(DiagnoseTool, ExaminesTheModelAsGivenWithItsFixedEffects) {
  const fs::path tied = case_ / "tied.toml";
  write_text(tied, read_text(case_ / "model.toml") +
                       "[[effect]]\nname = \"ligament\"\nstiffness_kpa_per_mm = 0.5\noffset_mm = 0\nwidth_mm = 12\n");
  const auto examined = [this](const fs::path& model) {
    const Finished finished = diagnose(model, {"--no-other-meshes", "--force"});
    EXPECT_EQ(finished.code, 0) << finished.err;
    return Json::parse(read_text(found_ / "diagnosis.json"));
  };
  const Json without = examined(case_ / "model.toml"), with = examined(tied);
  for (const Json& candidate : with.at("candidates")) EXPECT_NE(candidate.at("effect"), "ligament");
  EXPECT_NE(with.at("base_parameters"), without.at("base_parameters"));
  // What a cohort takes for known of a number where nothing is missing: the sigma of the same nuisance.
  bool replaces_a_nuisance = false;
  for (const Json& single : without.at("singles"))
    for (const Json& number : single.at("numbers")) {
      if (number.at("name") != "incompressibility.log_factor") continue;
      replaces_a_nuisance = true;
      EXPECT_NEAR(number.at("null_sd").get<double>(), 0.3, 1e-12);
    }
  EXPECT_TRUE(replaces_a_nuisance);
}

TEST_F(DiagnoseTool, TakesTheBodyToBeAsUnevenAsTheModelFileSays) {
  const auto patchiness = [this] {
    const Finished finished = diagnose({"--no-other-meshes", "--force"});
    EXPECT_EQ(finished.code, 0) << finished.err;
    return Json::parse(std::ifstream(found_ / "diagnosis.json"))["budget_mm"]["patchiness"].get<double>();
  };
  const double usual = patchiness();
  write_text(case_ / "model.toml",
             read_text(case_ / "model.toml") + "\n[patchiness]\ntissue = 0.5\nskin = 0.3\nmuscle_mm = 1.4\n");
  EXPECT_NEAR(patchiness(), 2 * usual, 0.5 * usual);  // the fit moves with its errors
}

TEST_F(DiagnoseTool, RefusesPriorsThatAreNone) {
  for (const char* wrong : {"0.5,0.3,0.15,0.5", "0.7,0.3,0,0"}) {
    const Finished finished = diagnose({"--prior", wrong});
    EXPECT_EQ(finished.code, 2) << wrong;
    EXPECT_NE(finished.err.find("add up to 1"), std::string::npos) << finished.err;
  }
  EXPECT_FALSE(fs::exists(found_));
}

TEST_F(DiagnoseTool, HoldsWhatIsBelievedOfTheNumberOfEffects) {
  const auto nothing = [this](const std::string& prior) {
    const Finished finished = diagnose({"--no-other-meshes", "--force", "--prior", prior});
    EXPECT_EQ(finished.code, 0) << finished.err;
    const Json json = Json::parse(std::ifstream(found_ / "diagnosis.json"));
    for (const auto& hypothesis : json["hypotheses"])
      if (hypothesis["effects"].empty()) return hypothesis["probability"].get<double>();
    return -1.0;
  };
  const double usual = nothing("0.5,0.3,0.15,0.05"), sure = nothing("0.97,0.01,0.01,0.01");
  EXPECT_GT(sure, usual);
}

/// What it says of the same case when something is left out.
struct Without {
  Json json;
  double budget(const std::string& part) const { return json.at("budget_mm").at(part); }
};

TEST_F(DiagnoseTool, ExaminesAsIfThereWereNoneOfWhatIsLeftOut) {
  const auto without = [this](const std::string& what) {
    const Finished finished = diagnose({"--no-other-meshes", "--force", "--without", what});
    EXPECT_EQ(finished.code, 0) << finished.err;
    EXPECT_NE(finished.err.find("as if there were no " + what), std::string::npos) << finished.err;
    return Without{Json::parse(read_text(found_ / "diagnosis.json"))};
  };
  EXPECT_LT(without("discrepancy").json.at("unexplained95")[1].get<double>(), 0.1);
  const Without placed = without("nuisances");
  for (const Json& sigma : placed.json.at("nuisances_sigma")) EXPECT_EQ(sigma.get<double>(), 0);
  EXPECT_EQ(placed.budget("registration"), 0);
  EXPECT_GT(placed.budget("patchiness"), 0);
  const Without even = without("patchiness");
  EXPECT_EQ(even.budget("patchiness"), 0);
  EXPECT_EQ(even.json.at("unlisted").at("probability").get<double>(), 0);
  EXPECT_GT(even.budget("registration"), 0);
}

TEST_F(DiagnoseTool, WithLandmarksLeftOutSaysWhatItSaysOfTheCaseThatHasNone) {
  const auto hypotheses = [this](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"--no-other-meshes", "--force"};
    words.insert(words.end(), more.begin(), more.end());
    const Finished finished = diagnose(words);
    EXPECT_EQ(finished.code, 0) << finished.err;
    return Json::parse(read_text(found_ / "diagnosis.json")).at("hypotheses");
  };
  const Json none = hypotheses({});
  write_text(case_ / "prone.csv", "name,x,y,z\nnipple,0,-39,0\nupper,3,-29.2,24\n");
  write_text(case_ / "supine.csv", "name,x,y,z\nnipple,0,-31.5,0\nupper,3,-24.2,24\n");
  write_text(case_ / "case.toml",
             replaced(read_text(case_ / "case.toml"), "supine.ply\"\n", "supine.ply\"\nlandmarks = \"supine.csv\"\n") +
                 "[landmarks]\nprone = \"prone.csv\"\n");
  EXPECT_EQ(hypotheses({"--without", "landmarks"}), none);
  EXPECT_NE(hypotheses({}), none);
}

TEST_F(DiagnoseTool, RefusesToLeaveOutWhatItDoesNotKnow) {
  const Finished finished = diagnose({"--without", "gravity"});
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("discrepancy"), std::string::npos) << finished.err;
  EXPECT_FALSE(fs::exists(found_));
}

TEST_F(DiagnoseTool, SaysWhatOtherPriorsAndLessTrustWouldChangeAndNothingElse) {
  const Finished finished = diagnose({"--no-other-meshes"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json json = Json::parse(read_text(found_ / "diagnosis.json"));
  const Json& others = json.at("under_other_priors");
  ASSERT_EQ(others.size(), 5u);
  EXPECT_EQ(others.back().at("what"), "the scans counting for half");
  for (const Json& other : others) {
    const bool changes = other.at("verdict") != json.at("verdict") || other.at("missing") != json.at("missing");
    const std::string what = other.at("what");
    EXPECT_EQ(finished.out.find("  with " + what) != std::string::npos, changes) << what << "\n" << finished.out;
    for (const Json& one : json.at("included")) {
      const double then = other.at("included").at(one.at("effect"));
      EXPECT_TRUE(then >= 0 && then <= 1) << what;
    }
    if (!changes) continue;
    for (const Json& name : other.at("missing")) {
      const double then = other.at("included").at(name.get<std::string>());
      const std::string words = fmt::format("{} {:.2f}", name.get<std::string>(), then);
      EXPECT_NE(finished.out.find(words), std::string::npos) << words << " is not in:\n" << finished.out;
    }
  }
}

TEST_F(DiagnoseTool, WarnsWhereTheMeshIsTakenToBeExact) {
  const Finished finished = diagnose({"--no-other-meshes"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.err.find("the mesh is taken to be exact (--no-other-meshes)"), std::string::npos) << finished.err;
  const Json json = Json::parse(std::ifstream(found_ / "diagnosis.json"));
  EXPECT_NE(json["warnings"].dump().find("taken to be exact"), std::string::npos) << json["warnings"];
}

}  // namespace
}  // namespace supine::pipeline
