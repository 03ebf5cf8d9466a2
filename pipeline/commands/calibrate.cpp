// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/calibrate.h"

#include <fmt/core.h>

#include <cmath>
#include <fstream>

#include "calibration/error_map.h"
#include "calibration/evaluator_pool.h"
#include "common/error.h"
#include "pipeline/case/journal_key.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/results/profile_table.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using calibration::FreeParameters;

class CalibrateTool : public Tool {
 public:
  std::string name() const override { return "supine-calibrate"; }

  std::string summary() const override {
    return "Finds the free parameters of a model (those written as tables in model.toml) from the measured surface, "
           "and "
           "says what the answer is worth.\n"
           "Writes model.toml with the fitted values, history.csv (every chain run) and calibration.json. -o names "
           "their folder (default: that of the mesh).\n\n"
           "Examples:\n"
           "  supine-calibrate mycase mycase/out/mesh.vtu\n"
           "  supine-calibrate mycase mycase/out/mesh.vtu --starts 5 --scan-offset -o trial\n"
           "  supine-calibrate mycase mycase/out/mesh.vtu --method cmaes --seed 3 --until-mae 1.0\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("mesh", mesh_file_, "imaged mesh, as supine-tetrahedralise writes it (.vtu)")->required();
    app.add_option("--model", model_file_, "the model to start from (default: CASE/model.toml)");
    app.add_option(
           "--method", options_.method,
           "joint (with all that is never known: place of the scans, gravity, breath, uneven tissue, the mesh's error; "
           "landmarks count; half a minute), least-squares (signed distances scan to model, scans taken to lie in "
           "place; seconds) or cmaes (the study's: MAE model to scan, without gradient; value and prior_sd are its "
           "start and sigma). Default: joint; least-squares beside an option that only it knows")
        ->check(CLI::IsMember({"least-squares", "joint", "cmaes"}));
    app.add_option("--until-mae", options_.until_mae_mm,
                   "MAE model to scan (study) to reach, mm: cmaes stops there; not reached: exit code 1");
    app.add_option("--seed", options_.seed, "of everything that is drawn")->capture_default_str();
    app.add_option("--starts", options_.starts, "descents from drawn starts, the first from the model's values")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app.add_option("--robust", options_.robust_mm, "a point further off than this many mm counts linearly")
        ->check(above_zero())
        ->capture_default_str();
    app.add_option("--intervals", options_.intervals,
                   "linear (from the sensitivities, no further runs), or profile (a few refits per parameter and end)")
        ->check(CLI::IsMember({"profile", "linear"}))
        ->capture_default_str();
    app.add_option("--population", options_.population,
                   "cmaes: runs per generation, at least 5; 0 = the larger of 6 and 4 + 3 ln n")
        ->check(CLI::Range(0, 10000))
        ->capture_default_str();
    app.add_option("--max-evaluations", options_.max_evaluations,
                   "cmaes: chain runs at most (the last generation is finished)")
        ->check(above_zero())
        ->capture_default_str();
    app.add_option("--map", map_,
                   "runs per axis of a map of the error over the first two free parameters around the answer "
                   "(error_map.csv, error_map.vti); 0 = none")
        ->check(CLI::Range(0, 1000))
        ->capture_default_str();
    auto* merge = app.add_option("--merge", parts_,
                                 "profiles.csv files of --profile-of: their intervals are taken; every free number "
                                 "must be there");
    app.add_option("--profile-of", options_.profile_of,
                   "with --intervals profile: of this free number alone; may be given several times. Writes "
                   "profiles.csv and no model")
        ->excludes(merge);
    app.add_flag("--no-priors", no_priors_, "take prior_sd of the model for nothing");
    app.add_flag("--scan-offset", options_.scan_offset,
                 "the scan may lie elsewhere: fit its shift and turn as well (effect misregistration)");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    options_.use_priors = !no_priors_;
    options_.map = map_ > 0;
    options_.choose_method();
    check_options();
    claim_targets(run);
    measured_ = read_measured_case(run, case_folder_, mesh_file_, model_file_);
    const FreeParameters parameters = parameters_to_fit(run, *measured_, options_);
    if (!parts_.empty()) options_.known_profiles = merged_profiles(parameters);
    if (map_ > 0 && parameters.size() < 2) throw InputError("--map needs two free parameters, the model has one");
    auto journal = options_.method == "cmaes" ? calibration::RunJournal(folder() / "calibration.runs", key())
                                              : calibration::RunJournal();
    const CalibrationResult result = calibrate(run, *measured_, parameters, options_, journal);
    if (!journal.file().empty()) run.no_longer_needed(journal.file());
    if (!options_.profile_of.empty()) {
      write_part(run, result);
      return judge(run, options_, result);
    }
    if (map_ > 0) {
      run.stage("map");
      write_map(run, parameters, result);
    }
    run.stage("write");
    write(run, parameters, result);
    say_calibration(run, parameters, result);
    return judge(run, options_, result);
  }

 private:
  fs::path folder() const { return output.empty() ? mesh_file_.parent_path() : output; }
  std::string key() const { return journal_key(*measured_, case_folder_, mesh_file_); }

  void check_options() const {
    options_.check();
    if (!parts_.empty() && options_.intervals != "profile") throw InputError("--merge goes with --intervals profile");
    if (!options_.profile_of.empty() && map_ > 0)
      throw InputError("--map goes with a whole calibration, not with --profile-of");
  }

  /// Before the work, so that nobody waits for an answer that cannot be written.
  void claim_targets(Run& run) const {
    const fs::path start = model_file_.empty() ? case_folder_ / "model.toml" : model_file_;
    std::error_code none;
    if (fs::equivalent(folder() / "model.toml", start, none))
      throw InputError(
          fmt::format("the fitted model would replace {}, which is the model to start from; name another "
                      "folder with -o",
                      start.string()));
    if (!options_.profile_of.empty()) {
      run.output(folder() / "profiles.csv");
      return;
    }
    for (const char* name : {"model.toml", "history.csv", "calibration.json"}) run.output(folder() / name);
    if (map_ > 0)
      for (const char* name : {"error_map.csv", "error_map.vti"}) run.output(folder() / name);
  }

  void write_map(Run& run, const FreeParameters& parameters, const CalibrationResult& result) const {
    constexpr double reach = 1.4;  // a factor of four either way
    calibration::RunJournal journal(folder() / "error_map.runs", key());
    calibration::EvaluatorPool pool(measured_->fitted_scene(), parameters, measured_->start, run.threads());
    LiveProgress live(run);
    std::size_t finished = journal.known();
    const auto map = calibration::map_error(
        pool, parameters, result.fit.u, {0, 1}, map_, reach, journal,
        [&](const calibration::RunResult&) { live.show(fmt::format("map: run {} of {}", ++finished, map_ * map_)); });
    const fs::path csv = folder() / "error_map.csv";
    calibration::write_map_csv(map, run.output(csv));
    calibration::write_map_vti(map, run.output(folder() / "error_map.vti"));
    run.figures(csv) = {{"parameters", {map.x_name, map.y_name}}, {"runs", map.results.size()}};
    run.no_longer_needed(journal.file());
  }

  void write(Run& run, const FreeParameters& parameters, const CalibrationResult& result) const {
    const fs::path model_file = folder() / "model.toml", history_file = folder() / "history.csv";
    std::ofstream(run.output(model_file), std::ios::binary) << fitted_model(*measured_, parameters, result).text;
    write_history(parameters, result.fit, run.output(history_file));
    run.figures(folder() / "calibration.json") = calibration_figures(*measured_, parameters, result);
    run.figures(model_file) = {{"fitted_from", measured_->model_text.file.filename().string()}};
    run.figures(history_file) = {{"rows", result.fit.history.size()}};
  }

  /// What the intervals depend on: parts of another fit are not merged.
  std::string depends_on() const {
    return fmt::format("{} robust {} starts {} seed {} priors {} scan offset {}", key(), options_.robust_mm,
                       options_.starts, options_.seed, options_.use_priors, options_.scan_offset);
  }

  void write_part(Run& run, const CalibrationResult& result) const {
    run.stage("write");
    const fs::path file = folder() / "profiles.csv";
    std::ofstream stream(run.output(file), std::ios::binary);
    write_profiles(result.profiles, stream);
    run.figures(file) = {{"depends_on", depends_on()}};
    for (const auto& [name, profile] : result.profiles)
      run.say(fmt::format("  {} {:.4g} to {:.4g}, {} chain runs", name, profile.interval.low, profile.interval.high,
                          profile.runs));
  }

  Profiles merged_profiles(const FreeParameters& parameters) const {
    std::vector<std::pair<fs::path, Profiles>> parts;
    for (const fs::path& file : parts_) {
      parts.emplace_back(file, read_profiles(file));
      const fs::path sidecar = fs::path(file).replace_extension(".json");
      std::ifstream stream(sidecar);
      const auto said = nlohmann::ordered_json::parse(stream, nullptr, false);
      if (said.is_discarded() || said.value("depends_on", "") != depends_on())
        throw InputError(fmt::format(
            "{}: the part was not made by this program from this case, model, mesh, scans and options; make it again "
            "with --profile-of",
            sidecar.string()));
    }
    return merge_profiles(parts, parameters.names());
  }

  static void write_history(const FreeParameters& parameters, const calibration::Fit& fit, const fs::path& file) {
    std::ofstream stream(file, std::ios::binary);
    stream << "evaluation,start";
    for (const std::string& name : parameters.names()) stream << "," << name;
    stream << ",mae_study_mm,mae_mm,rms_mm,failed,accepted\n";
    const auto number = [](double value) { return std::isfinite(value) ? fmt::format("{}", value) : std::string(); };
    for (std::size_t i = 0; i < fit.history.size(); ++i) {
      const calibration::FitEvaluation& row = fit.history[i];
      stream << i + 1 << "," << row.start;
      for (const double value : row.values) stream << "," << number(value);
      stream << "," << number(row.mae_study_mm) << "," << number(row.mae_mm) << "," << number(row.rms_mm) << ","
             << row.failed << "," << row.accepted << "\n";
    }
    if (!stream.flush()) throw InputError("writing history.csv failed; check the free space on the disk");
  }

  fs::path case_folder_, mesh_file_, model_file_;
  CalibrateOptions options_;
  std::vector<fs::path> parts_;
  int map_ = 0;
  bool no_priors_ = false;
  std::unique_ptr<MeasuredCase> measured_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::CalibrateTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
