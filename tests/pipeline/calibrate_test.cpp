// SPDX-License-Identifier: AGPL-3.0-or-later
// The built calibration, sensitivity and diagnosis tools on a small case.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pipeline/case/model_file.h"
#include "tests/pipeline/process.h"
#include "tests/pipeline/simulated_scan.h"
#include "tests/pipeline/small_case.h"
#include "tests/pipeline/small_run.h"
#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

const std::string model_text = R"([breast]
law = "neo_hookean"
young_modulus_kpa = { value = 1.5, prior_sd = 0.5, lower = 0.3, upper = 20 }  # from the clinic
[skin]
young_modulus_kpa = { value = 30, prior_sd = 20, lower = 1, upper = 300 }
)";

class Calibrate : public testing::Test {
 protected:
  Calibrate() {
    run_process({"cp", "-a", small_run().string(), folder().string()});
    write_text(folder() / "model.toml", model_text);
  }
  Finished run(const std::string& name, const std::string& to, std::vector<std::string> more = {}) {
    std::vector<std::string> command = {tool(name), folder().string(), (folder() / "out/mesh.vtu").string(), "-o",
                                        (folder() / to).string()};
    command.insert(command.end(), more.begin(), more.end());
    return run_process(command);
  }
  Json json(const fs::path& file) const { return Json::parse(std::ifstream(folder() / file)); }
  std::string bytes(const fs::path& file) const { return read_text(folder() / file); }
  /// Everything but what is outside the promise of identical bytes.
  std::string without_timing(const fs::path& file) const {
    Json all = json(file);
    all.erase("timing");
    return all.dump();
  }
  fs::path folder() const { return folder_ / "case"; }
  TemporaryFolder folder_;
};

TEST_F(Calibrate, LowersTheErrorAndSaysWhatTheAnswerIsWorth) {
  const Finished finished = run("calibrate", "fit");
  ASSERT_LE(finished.code, 1) << finished.err;
  const Json result = json("fit/calibration.json");
  for (const char* key : {"method", "mae_study_mm", "mae_mm", "rms_mm", "held_out_rms_mm", "parameters", "evaluations",
                          "iterations", "failed_solves", "worth", "error_model", "remarks"})
    EXPECT_TRUE(result.contains(key)) << key;
  std::istringstream history(bytes("fit/history.csv"));
  std::string header, first;
  std::getline(history, header);
  std::getline(history, first);
  EXPECT_EQ(
      header,
      "evaluation,start,breast.young_modulus_kpa,skin.young_modulus_kpa,mae_study_mm,mae_mm,rms_mm,failed,accepted");
  std::vector<std::string> fields;
  std::istringstream row(first);
  for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
  EXPECT_LT(result["rms_mm"].get<double>(), std::stod(fields.at(fields.size() - 3)));
  for (const Json& parameter : result["parameters"]) {
    EXPECT_LE(parameter["interval95"][0], parameter["value"]);
    EXPECT_GE(parameter["interval95"][1], parameter["value"]);
  }
}

TEST_F(Calibrate, BeginsStifferWhereTheModelCarriesNothingAndEndsWhereAStiffStartEnds) {
  const auto fitted_from = [this](const std::string& kpa) {
    write_text(folder() / "model.toml", "[breast]\nlaw = \"neo_hookean\"\nyoung_modulus_kpa = { value = " + kpa +
                                            ", prior_sd = 0.5, lower = 0.01, upper = 20 }\n");
    const Finished finished = run("calibrate", kpa, {"--method", "least-squares"});
    EXPECT_LE(finished.code, 1) << finished.err;
    EXPECT_EQ(kpa == "0.02", finished.err.find("is where the search begins (its prior stays)") != std::string::npos)
        << finished.err;
    return json(fs::path(kpa) / "calibration.json")["parameters"][0]["value"].get<double>();
  };
  const double stiff = fitted_from("1.5");
  EXPECT_NEAR(fitted_from("0.02"), stiff, 0.02 * stiff);
}

TEST_F(Calibrate, AStandInForAModelThatCarriesNothingJudgesLandmarksAboutTheirMean) {
  write_text(folder() / "prone.csv", "name,x,y,z\nnipple,0,-39,0\n");
  write_text(folder() / "case.toml", replaced(read_text(folder() / "case.toml"), "supine.ply\"\n",
                                              "supine.ply\"\nlandmarks = \"supine.csv\"\n") +
                                         "[landmarks]\nprone = \"prone.csv\"\n");
  const auto is_refused = [this](const std::string& kpa, const std::string& z_mm) {
    write_text(folder() / "supine.csv", "name,x,y,z\nnipple,0,-31.5," + z_mm + "\n");
    write_text(folder() / "model.toml", "[breast]\nlaw = \"neo_hookean\"\nyoung_modulus_kpa = { value = " + kpa +
                                            ", prior_sd = 0.5, lower = 0.01, upper = 20 }\n");
    const Finished done = run("calibrate", kpa + "_" + z_mm);
    return done.err.find("from where the model has it") != std::string::npos;
  };
  EXPECT_TRUE(is_refused("1.5", "80"));
  EXPECT_FALSE(is_refused("0.02", "80")) << "a stiff body moves too little";
  EXPECT_TRUE(is_refused("0.02", "250")) << "no breast moves as far";
}

TEST_F(Calibrate, WritesTheModelWithCommentsAndFittedNumbers) {
  ASSERT_LE(run("calibrate", "fit").code, 1);
  const std::string text = bytes("fit/model.toml");
  EXPECT_NE(text.find("# from the clinic"), std::string::npos);
  EXPECT_EQ(bytes("model.toml"), model_text);  // the user's own stays
  const simulation::Model model = read_model(folder() / "fit/model.toml");
  EXPECT_EQ(model.breast.young_modulus_kpa.value, json("fit/calibration.json")["parameters"][0]["value"].get<double>());
  EXPECT_EQ(model.breast.young_modulus_kpa.prior_sd, 0.5);
}

TEST_F(Calibrate, GivesTheSameBytesForAnyNumberOfThreads) {
  ASSERT_LE(run("calibrate", "one", {"--threads", "1", "--map", "2"}).code, 1);
  ASSERT_LE(run("calibrate", "two", {"--threads", "2", "--map", "2"}).code, 1);
  for (const char* name : {"model.toml", "history.csv", "error_map.csv", "error_map.vti"})
    EXPECT_EQ(bytes(fs::path("one") / name), bytes(fs::path("two") / name)) << name;
  EXPECT_EQ(without_timing("one/calibration.json"), without_timing("two/calibration.json"));
}

TEST_F(Calibrate, ProfilesInPartsGiveTheBytesOfOneRun) {
  const std::vector<std::string> profile = {"--intervals", "profile"};
  const auto with = [&profile](std::vector<std::string> more) {
    more.insert(more.end(), profile.begin(), profile.end());
    return more;
  };
  ASSERT_LE(run("calibrate", "whole", profile).code, 1);
  ASSERT_LE(run("calibrate", "skin", with({"--profile-of", "skin.young_modulus_kpa"})).code, 1);
  ASSERT_LE(run("calibrate", "breast", with({"--profile-of", "breast.young_modulus_kpa"})).code, 1);
  EXPECT_FALSE(fs::exists(folder() / "skin/model.toml"));
  const std::string skin = (folder() / "skin/profiles.csv").string(),
                    breast = (folder() / "breast/profiles.csv").string();
  ASSERT_LE(run("calibrate", "merged", with({"--merge", skin, breast})).code, 1);
  for (const char* file : {"model.toml", "history.csv"})
    EXPECT_EQ(bytes(fs::path("merged") / file), bytes(fs::path("whole") / file));
  EXPECT_EQ(without_timing("merged/calibration.json"), without_timing("whole/calibration.json"));
  EXPECT_GT(json("whole/calibration.json")["profile_evaluations"].get<int>(), 3);

  const auto refused = [&](std::vector<std::string> words, const std::string& message) {
    const Finished finished = run("calibrate", "none", std::move(words));
    EXPECT_EQ(finished.code, 2);
    EXPECT_NE(finished.err.find(message), std::string::npos) << finished.err;
    EXPECT_FALSE(fs::exists(folder() / "none"));
  };
  refused(with({"--merge", skin}), "breast.young_modulus_kpa is in no part; make it with --profile-of");
  refused(with({"--merge", skin, skin, breast}), "skin.young_modulus_kpa is in another part too");
  refused(with({"--robust", "3", "--merge", skin, breast}), "was not made by this program from this case");
  refused({"--merge", skin, breast}, "--merge goes with --intervals profile");
  refused(with({"--profile-of", "skin.young_modulus"}),
          "--profile-of skin.young_modulus: the model has no such free number");
  refused({"--profile-of", "skin.young_modulus_kpa"}, "--profile-of goes with --intervals profile");
  write_text(folder() / "skin/profiles.csv", "parameter,low,high,runs\nskin.young_modulus_kpa,1,2\n");
  refused(with({"--merge", skin, breast}), "profiles.csv:2: must be a row of parameter,low,high,runs");
}

TEST_F(Calibrate, LeavesOutPointsThatStandOutAndSaysSo) {
  ASSERT_LE(run("calibrate", "as_it_is", {"--method", "least-squares"}).code, 1);
  EXPECT_EQ(json("as_it_is/calibration.json")["warnings"].dump().find("stand out"), std::string::npos);
  int row = 0;
  write_scan(folder() / "supine.ply", [&row](std::array<double, 3> p) {
    if (row++ % 30 == 7) p[1] += 8;
    return p;
  });
  const Finished finished = run("calibrate", "dirty", {"--method", "least-squares"});
  ASSERT_LE(finished.code, 1) << finished.err;
  EXPECT_NE(finished.err.find("supine.ply"), std::string::npos) << finished.err;
  EXPECT_NE(finished.err.find("stand out of their neighbours"), std::string::npos) << finished.err;
  const auto left_out = [this](const char* run) {
    return json(fs::path(run) / "calibration.json")["poses"][0]["points_left_out"].get<int>();
  };
  EXPECT_LE(left_out("as_it_is"), 2);
  EXPECT_GE(left_out("dirty"), row / 40);  // of one in thirty, some lie beyond the model's skin
  EXPECT_LE(left_out("dirty"), row / 30 + 1);
  // A comparison with the model that the fit began with calls the same points out.
  ASSERT_EQ(run("simulate", "start").code, 0);
  const std::string case_folder = folder().string(), start = (folder() / "start").string();
  ASSERT_EQ(run_process({tool("compare"), case_folder, start + "/supine.vtu", "-o", start}).code, 0);
  const Json comparison = json("start/comparison.json");
  EXPECT_EQ(comparison["left_out_points"], left_out("dirty"));
  EXPECT_LT(comparison["rms_kept_mm"].get<double>(), 0.9 * comparison["rms_mm"].get<double>());
  for (const char* key : {"rms_mm", "mae_study_mm"}) {
    const double clean = json("as_it_is/calibration.json")[key].get<double>();
    EXPECT_NEAR(json("dirty/calibration.json")[key].get<double>(), clean, 0.2 * clean) << key;
  }
}

TEST_F(Calibrate, CmaesMissesAnImpossibleTargetAndSaysSo) {
  const Finished finished =
      run("calibrate", "cma", {"--method", "cmaes", "--max-evaluations", "6", "--until-mae", "0.001"});
  EXPECT_EQ(finished.code, 1) << finished.err;
  EXPECT_NE(finished.err.find("--until-mae"), std::string::npos) << finished.err;
  EXPECT_EQ(json("cma/calibration.json")["method"], "cmaes");
  EXPECT_EQ(json("cma/calibration.json")["evaluations"], 6);
  EXPECT_FALSE(fs::exists(folder() / "cma/calibration.runs"));
}

TEST_F(Calibrate, JointlyFitsWhatIsNeverKnown) {
  const Finished plain = run("calibrate", "plain", {"--method", "least-squares"}), joint = run("calibrate", "joint");
  ASSERT_LE(plain.code, 1) << plain.err;
  ASSERT_LE(joint.code, 1) << joint.err;
  const Json result = json("joint/calibration.json"), before = json("plain/calibration.json");
  EXPECT_EQ(result["method"], "joint");
  EXPECT_EQ(result["interval_kind"], "posterior");
  EXPECT_EQ(result["landmarks_used"], 0);
  EXPECT_NE(result["parameters"][0]["value"], before["parameters"][0]["value"]) << "the mesh's error is taken away";
  std::map<std::string, Json> nuisances;
  for (const Json& one : result["nuisances"]) nuisances[one["name"]] = one;
  ASSERT_TRUE(nuisances.contains("supine/misregistration.shift_x_mm")) << result["nuisances"];
  EXPECT_GT(nuisances["supine/misregistration.shift_x_mm"]["sd"].get<double>(), 0);
  EXPECT_LT(nuisances["supine/misregistration.shift_y_mm"]["sd"].get<double>(), 1.5) << "2 mm before the scan";
  const simulation::Model model = read_model(folder() / "joint/model.toml");
  EXPECT_NEAR(model.breast.young_modulus_kpa.value, result["parameters"][0]["value"].get<double>(), 1e-5);
  EXPECT_TRUE(model.effects.empty()) << "where a scan lies is no property of the breast";
}

TEST_F(Calibrate, SaysHowFarTheModelIsOffWhereScansLieAsGiven) {
  ASSERT_LE(run("calibrate", "joint").code, 1);
  const Json result = json("joint/calibration.json");
  std::istringstream history(bytes("joint/history.csv"));
  std::string line;
  std::vector<std::string> rows;
  while (std::getline(history, line)) rows.push_back(line);
  ASSERT_EQ(rows.size(), 1 + result["evaluations"].get<std::size_t>());
  const auto accepted =
      std::count_if(rows.begin() + 1, rows.end(), [](const auto& row) { return row.ends_with(",1"); });
  EXPECT_EQ(accepted, 1 + result["iterations"].get<int>()) << "the first, and each step";
  ASSERT_EQ(run("simulate", "joint", {"--model", (folder() / "joint/model.toml").string(), "--force"}).code, 0);
  const std::string out = (folder() / "joint").string();
  ASSERT_EQ(
      run_process({tool("compare"), folder().string(), out + "/supine.vtu", "--model", out + "/model.toml", "-o", out})
          .code,
      0);
  const double compared = json("joint/comparison.json")["rms_kept_mm"].get<double>();
  EXPECT_NEAR(result["as_given"]["rms_mm"].get<double>(), compared, 0.02 * compared);
  EXPECT_LT(result["rms_mm"].get<double>(), compared);
}

TEST_F(Calibrate, WarnsOfAScanThatNothingExplains) {
  const auto warned = [this](const char* to) {
    const Finished finished = run("calibrate", to, {"--method", "joint"});
    EXPECT_LE(finished.code, 1) << finished.err;
    return finished.err.find("the fit makes up for something else") != std::string::npos;
  };
  write_simulated_scan(folder() / "out/supine.vtu", folder() / "simulated.vtp");
  std::string text = replaced(bytes("case.toml"), "supine.ply", "simulated.vtp");
  write_text(folder() / "case.toml", text);
  EXPECT_FALSE(warned("in_place"));
  // A scan 10 mm from where it is said to lie to a tenth of a millimetre.
  text.insert(text.find("surface"), "registration_mm = 0.1\n");
  write_text(folder() / "case.toml", text);
  write_simulated_scan(folder() / "out/supine.vtu", folder() / "simulated.vtp", {0, 10, 0});
  EXPECT_TRUE(warned("elsewhere"));
}

TEST_F(Calibrate, TakesLeastSquaresBesideAnOptionThatOnlyItKnows) {
  ASSERT_LE(run("calibrate", "robust", {"--robust", "3"}).code, 1);
  const Json chosen = json("robust/calibration.json");
  EXPECT_EQ(chosen["method"], "least-squares");
  EXPECT_FALSE(chosen.contains("as_given"));
  for (const Json& coordinate : chosen["worth"]["coordinates"]) {
    double square = 0;
    for (const auto& [source, sd] : coordinate["sd_never_known"].items()) square += sd.get<double>() * sd.get<double>();
    EXPECT_GT(coordinate["sd_never_known"]["registration"].get<double>(), 0);
    EXPECT_LT(square, std::pow(coordinate["sd"].get<double>(), 2));
  }
  // Where the place of the scan is known, it leaves less open.
  std::string text = bytes("case.toml");
  text.insert(text.find("surface"), "registration_mm = 0.1\n");
  write_text(folder() / "case.toml", text);
  ASSERT_LE(run("calibrate", "placed", {"--method", "least-squares", "--robust", "3"}).code, 1);
  const Json placed = json("placed/calibration.json");
  for (std::size_t i = 0; i < 2; ++i) {
    const auto sd = [i](const Json& of) {
      return of["worth"]["coordinates"][i]["sd_never_known"]["registration"].get<double>();
    };
    EXPECT_NEAR(sd(placed), 0.05 * sd(chosen), 1e-6 * sd(chosen));
    EXPECT_EQ(placed["parameters"][i]["value"], chosen["parameters"][i]["value"]);
  }
}

TEST_F(Calibrate, RefusesWhatAMethodDoesNotUse) {
  using Words = std::vector<std::string>;
  const std::vector<std::pair<std::string, std::vector<Words>>> unused = {
      {"joint",
       {{"--no-priors"},
        {"--scan-offset"},
        {"--intervals", "profile"},
        {"--starts", "3"},
        {"--robust", "3"},
        {"--map", "3"},
        {"--population", "8"},
        {"--max-evaluations", "9"}}},
      {"least-squares", {{"--population", "8"}, {"--max-evaluations", "9"}}},
      {"cmaes", {{"--robust", "3"}, {"--starts", "3"}, {"--intervals", "profile"}, {"--population", "1"}}}};
  for (const auto& [method, options] : unused)
    for (const Words& more : options) {
      Words words = {"--method", method};
      words.insert(words.end(), more.begin(), more.end());
      const Finished finished = run("calibrate", "refused", words);
      EXPECT_EQ(finished.code, 2) << method << " " << more[0];
      EXPECT_NE(finished.err.find(more[0].substr(2)), std::string::npos) << finished.err;
      EXPECT_FALSE(fs::exists(folder() / "refused"));
    }
}

TEST_F(Calibrate, RefusesWhatItCannotDo) {
  const std::string fixed = "[breast]\nyoung_modulus_kpa = 1.5\n";
  write_text(folder() / "fixed.toml", fixed);
  Finished finished = run("calibrate", "fit", {"--model", (folder() / "fixed.toml").string()});
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("no free parameter"), std::string::npos) << finished.err;
  finished = run("calibrate", ".");  // would replace the user's model
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("name another folder"), std::string::npos) << finished.err;
  EXPECT_EQ(bytes("model.toml"), model_text);
  EXPECT_FALSE(fs::exists(folder() / "fit"));
}

TEST_F(Calibrate, SaysThatAnOutputExistsBeforeTheWork) {
  fs::remove(folder() / "out/mesh.vtu");  // nothing can be computed: what is said comes before
  for (const char* name : {"fit/model.toml", "fit/history.csv", "fit/calibration.json", "fit/error_map.csv"}) {
    fs::create_directories(folder() / "fit");
    write_text(folder() / name, "somebody's\n");
    const Finished finished = run("calibrate", "fit", {"--map", "2"});
    EXPECT_EQ(finished.code, 2);
    EXPECT_NE(finished.err.find(fs::path(name).filename().string() + " exists"), std::string::npos) << finished.err;
    EXPECT_EQ(bytes(name), "somebody's\n");
    EXPECT_EQ(files_in(folder() / "fit").size(), 1u);
    fs::remove_all(folder() / "fit");
  }
  write_text(folder() / "s.json", "somebody's\n");
  const Finished finished = run("sensitivity", "s.csv");
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("s.json exists"), std::string::npos) << finished.err;
}

TEST_F(Calibrate, SensitivityGoesThroughItsDraws) {
  const Finished finished = run("sensitivity", "s", {"--samples", "10", "--law", "normal", "--seed", "3"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json result = json("s/sensitivity.json");
  EXPECT_EQ(result["samples"], 10);
  EXPECT_EQ(result["parameters"].size(), 2u);
  EXPECT_GT(result["mae_study_mm"]["sd"].get<double>(), 0);
  EXPECT_FALSE(fs::exists(folder() / "s/sensitivity.runs"));
  const std::string text = bytes("s/sensitivity.csv");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 11);
}

/// The small case's scan is flatter than tissue of 1.5 kPa can be: a prior that lets the body fit it.
const std::string soft_text = R"([breast]
law = "neo_hookean"
young_modulus_kpa = { value = 0.4, prior_sd = 0.4, lower = 0.1, upper = 20 }
[skin]
young_modulus_kpa = { value = 30, prior_sd = 20, lower = 1, upper = 300 }
)";

TEST_F(Calibrate, DiagnosisAsksTheWholeCatalogue) {
  write_text(folder() / "model.toml", soft_text);
  ASSERT_LE(run("calibrate", "out", {"--force"}).code, 1);
  const Finished finished = run("diagnose", "out", {"--force", "--refit", "1"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json result = json("out/diagnosis.json");
  for (const char* key : {"verdict", "missing", "candidates", "base_held_out_rms_mm", "budget_mm", "hot_spots",
                          "cannot_see", "next_measurement"})
    EXPECT_TRUE(result.contains(key)) << key;
  EXPECT_GT(result["candidates"].size(), 8u);
  int refitted = 0;
  for (const Json& candidate : result["candidates"]) refitted += !candidate["refit_rms_mm"].is_null();
  EXPECT_GE(refitted, 1);
  EXPECT_LT(refitted, static_cast<int>(result["candidates"].size())) << "six times --refit sets at the most";
}

TEST_F(Calibrate, PlacesAreAskedOfWhatTheSameCallFindsOut) {
  std::vector<std::string> command = make_command(folder());
  command.insert(command.end(), {"--dry-run", "diagnose", "targets"});
  const Finished told = run_process(command);
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_NE(told.out.find("out/model.toml --diagnosis "), std::string::npos) << told.out;
  command.insert(command.end() - 1, "ladder");
  EXPECT_NE(run_process(command).out.find("out/ladder/model.toml --diagnosis "), std::string::npos);
}

TEST_F(Calibrate, MakeGoesFromTheMeshToTheDiagnosisAndRunsNothingTwice) {
  write_text(folder() / "model.toml", soft_text);
  std::vector<std::string> command = make_command(folder());
  command.insert(command.end(), {"calibrate", "diagnose"});
  const Finished first = run_process(command);
  ASSERT_EQ(first.code, 0) << first.err;
  for (const char* name :
       {"model.toml", "history.csv", "calibration.json", "diagnosis.json", "calibrated/comparison.vtp"})
    EXPECT_TRUE(fs::exists(folder() / "out" / name)) << name;
  const Finished second = run_process(command);
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_EQ(second.out.find("== "), std::string::npos) << second.out;
}

}  // namespace
}  // namespace supine::pipeline
