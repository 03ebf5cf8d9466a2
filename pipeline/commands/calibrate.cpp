// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <cmath>
#include <fstream>

#include "calibration/cmaes.h"
#include "calibration/error_map.h"
#include "calibration/held_out.h"
#include "common/error.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/weighted_fit.h"
#include "pipeline/case/case_priors.h"
#include "pipeline/case/journal_key.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/case/model_edit.h"
#include "pipeline/case/model_file.h"
#include "pipeline/case/population_priors.h"
#include "pipeline/results/calibration_report.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using calibration::Evaluator;
using calibration::Fit;
using calibration::FreeParameters;

/// The fit as the statistics of surfaces take it: without landmarks.
Fit skin_of(Fit fit) {
  fit.linearisation.slope.conservativeResize(fit.residuals.skin_rows(), Eigen::NoChange);
  fit.residuals = fit.residuals.skin();
  return fit;
}

/// The scan's place as six more unknowns, with the catalogue's priors.
void add_scan_offset(simulation::Model& model) {
  for (const auto& effect : model.effects)
    if (simulation::traits_of(effect.name).moves_scan) return;
  const simulation::Effect& effect = simulation::place_of_scan();
  simulation::EffectSetting setting = simulation::null_setting(effect);
  for (const simulation::Parameter& row : effect.parameters())
    setting.parameters[row.name] = {row.null, true, row.spread, row.lower, row.upper};
  model.effects.push_back(setting);
}

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
           "--method", method_,
           "least-squares (signed distances scan to model, exact sensitivities), joint (with all that is never known: "
           "place of the scans, gravity, breath, uneven tissue, the mesh's error; landmarks count; a minute) or cmaes "
           "(the study's: MAE model to scan, without gradient; value and prior_sd are its start and sigma)")
        ->check(CLI::IsMember({"least-squares", "joint", "cmaes"}))
        ->capture_default_str();
    app.add_option("--until-mae", until_mae_,
                   "MAE model to scan (study) to reach, mm: cmaes stops there; not reached: exit code 1");
    app.add_option("--seed", seed_, "of everything that is drawn")->capture_default_str();
    app.add_option("--starts", starts_, "descents from drawn starts, the first from the model's values")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app.add_option("--robust", robust_mm_, "a point further off than this many mm counts linearly")
        ->check(above_zero())
        ->capture_default_str();
    app.add_option("--intervals", intervals_,
                   "linear (from the sensitivities, no further runs), or profile (a few refits per parameter and end)")
        ->check(CLI::IsMember({"profile", "linear"}))
        ->capture_default_str();
    app.add_option("--population", population_, "cmaes: runs per generation, 0 = 4 + 3 ln n, at least 6")
        ->check(CLI::Range(0, 10000))
        ->capture_default_str();
    app.add_option("--max-evaluations", max_evaluations_, "cmaes: chain runs at most (the last generation is finished)")
        ->check(above_zero())
        ->capture_default_str();
    app.add_option("--map", map_,
                   "runs per axis of a map of the error over the first two free parameters around the answer "
                   "(error_map.csv, error_map.vti); 0 = none")
        ->check(CLI::Range(0, 1000))
        ->capture_default_str();
    app.add_flag("--no-priors", no_priors_, "take prior_sd of the model for nothing");
    app.add_flag("--scan-offset", scan_offset_,
                 "the scan may lie elsewhere: fit its shift and turn as well (effect misregistration)");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    check_method();
    claim_targets(run);
    measured_ = read_measured_case(run, case_folder_, mesh_file_, model_file_);
    if (method_ == "cmaes") measured_->check_covers_skin("--method cmaes");
    if (until_mae_) measured_->check_covers_skin("--until-mae");
    simulation::Model model = with_population(run, measured_->description, measured_->model);
    if (scan_offset_) add_scan_offset(model);
    FreeParameters parameters(model);
    parameters.begin_with(measured_->begin_with(model));
    if (map_ > 0 && parameters.size() < 2) throw InputError("--map needs two free parameters, the model has one");
    Evaluator evaluator(measured_->fitted_scene(), model);
    const CalibrationResult result = calibrate(run, evaluator, parameters);
    if (map_ > 0) {
      run.stage("map");
      write_map(run, parameters, result);
    }
    run.stage("write");
    write(run, parameters, result);
    say_calibration(run, parameters, result);
    return judge_target(run, result);
  }

 private:
  fs::path folder() const { return output.empty() ? mesh_file_.parent_path() : output; }

  void check_method() const {
    if (method_ != "joint") return;
    for (const auto& [given, option] : {std::pair(no_priors_, "--no-priors"), std::pair(scan_offset_, "--scan-offset"),
                                        std::pair(intervals_ == "profile", "--intervals profile"),
                                        std::pair(starts_ > 1, "--starts"), std::pair(map_ > 0, "--map")})
      if (given)
        throw InputError(
            fmt::format("{} goes with another method than joint, which has priors, the scans' places and "
                        "the intervals of its posterior in it; leave {} out, or take --method least-squares",
                        option, option));
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
    for (const char* name : {"model.toml", "history.csv", "calibration.json"}) run.output(folder() / name);
    if (map_ > 0)
      for (const char* name : {"error_map.csv", "error_map.vti"}) run.output(folder() / name);
  }

  calibration::FitOptions fit_options(Run& run, Evaluator& evaluator, LiveProgress& live) const {
    calibration::FitOptions options;
    options.robust_mm = robust_mm_;
    options.use_priors = !no_priors_;
    options.starts = starts_;
    options.seed = seed_;
    options.noise_mm = measured_->noise_mm(evaluator);
    options.near = &measured_->start;
    options.progress = [&live](const calibration::FitProgress& p) {
      live.show(fmt::format("run {}: RMS {:.3f} mm, best {:.3f} mm, {} without equilibrium{}", p.evaluations, p.rms_mm,
                            p.best_rms_mm, p.failed, p.outside_tissue ? "; at moduli that no tissue has" : ""));
    };
    for (std::size_t m = 0; m < options.noise_mm.size(); ++m)
      if (!measured_->fitted[m].noise_mm)
        run.say(fmt::format("  noise of {} not given, estimated: {:.2f} mm", measured_->fitted[m].pose.name,
                            options.noise_mm[m]));
    return options;
  }

  CalibrationResult calibrate(Run& run, Evaluator& evaluator, const FreeParameters& parameters) {
    LiveProgress live(run);
    const calibration::FitOptions options = fit_options(run, evaluator, live);
    CalibrationResult result;
    result.method = method_;
    result.object = measured_->description.is_object();
    result.noise_mm = options.noise_mm;
    run.stage("fit");
    Eigen::MatrixXd posterior;
    if (method_ == "joint")
      posterior = fit_jointly(parameters, options, live, result);
    else
      result.fit = method_ == "cmaes" ? search_cmaes(run, evaluator, parameters, options, live)
                                      : calibration::fit_least_squares(evaluator, parameters, options);
    run.stage("worth");
    result.uncertainty = calibration::judge(skin_of(result.fit), parameters, options.use_priors);
    if (method_ == "joint") result.uncertainty.covariance = posterior;
    result.interval_kind = method_ == "joint" ? "posterior" : intervals_;
    if (method_ == "cmaes") result.interval_kind = "linear";  // another optimum than that of the profiled cost
    if (result.interval_kind == "profile") {
      int runs = 0;
      result.intervals =
          calibration::profile_intervals(evaluator, parameters, options, result.fit, result.uncertainty, runs);
      profile_runs_ = runs;
    } else {
      result.intervals = calibration::linear_intervals(result.fit, parameters, result.uncertainty);
    }
    hold_out(parameters, options, result);
    return result;
  }

  /// Moduli together with all that is never known. @return  covariance of the coordinates, over all else
  Eigen::MatrixXd fit_jointly(const FreeParameters& parameters, const calibration::FitOptions& options,
                              LiveProgress& live, CalibrationResult& result) const {
    diagnosis::BaseFitOptions joint;
    joint.priors = case_priors(measured_->description, {});
    joint.priors.patchiness = read_patchiness(measured_->model_file);
    joint.progress = [&live](const std::string& what) { live.show(what); };
    Evaluator evaluator(measured_->marked_scene(), parameters.base(), diagnosis::accurate_enough());
    diagnosis::BaseFit base =
        diagnosis::fit_base_model(evaluator, parameters.base(), measured_->begin_with(parameters.base()),
                                  options.noise_mm, &measured_->start, joint);
    const diagnosis::JointPosterior posterior = diagnosis::posterior_of(base);
    for (Eigen::Index k = parameters.size(); k < posterior.value.size(); ++k)
      result.nuisances.push_back({posterior.names[static_cast<std::size_t>(k)], posterior.value[k], posterior.sd[k]});
    result.fit = std::move(base.fit);
    result.fit.evaluations = base.evaluations;
    result.fit.converged = true;
    result.fit.message = "joint fit with all that is never known";
    return posterior.of_parameters;
  }

  Fit search_cmaes(Run& run, Evaluator& evaluator, const FreeParameters& parameters,
                   const calibration::FitOptions& fit_options, LiveProgress& live) const {
    calibration::CmaesOptions options;
    options.seed = seed_;
    options.population = population_;
    options.max_evaluations = max_evaluations_;
    options.until_mae_mm = until_mae_;
    options.progress = [&live](int evaluations, int failed, double best) {
      live.show(fmt::format("after {} runs: best MAE {:.3f} mm, {} without equilibrium", evaluations, best, failed));
    };
    calibration::RunJournal journal(folder() / "calibration.runs", journal_key(*measured_, case_folder_, mesh_file_));
    if (journal.known() > 0) run.say(fmt::format("  going on after {} chain runs", journal.known()));
    calibration::EvaluatorPool pool(measured_->fitted_scene(), parameters, measured_->start, run.threads());
    const calibration::CmaesResult found = calibration::minimise_cmaes(pool, parameters, options, journal);
    Eigen::VectorXd u(parameters.size());
    for (Eigen::Index i = 0; i < u.size(); ++i) u[i] = parameters.coordinate(i, found.values[i]);
    Fit fit = calibration::evaluate_fit(evaluator, parameters, fit_options, u);
    fit.history = found.history;
    fit.evaluations = found.evaluations, fit.failed = found.failed, fit.iterations = found.generations;
    fit.message = found.message;
    fit.converged = found.evaluations < max_evaluations_ || found.target_met;
    run.no_longer_needed(journal.file());
    return fit;
  }

  void write_map(Run& run, const FreeParameters& parameters, const CalibrationResult& result) const {
    constexpr double reach = 1.4;  // a factor of four either way
    calibration::RunJournal journal(folder() / "error_map.runs", journal_key(*measured_, case_folder_, mesh_file_));
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

  void hold_out(const FreeParameters& parameters, const calibration::FitOptions& options,
                CalibrationResult& result) const {
    const Fit fit = skin_of(result.fit);
    const auto& residuals = fit.residuals;
    const auto as_list = [](const Eigen::VectorXd& d) { return std::vector<double>(d.begin(), d.end()); };
    result.in_sample = calibration::figures_of(as_list(residuals.distance_mm));
    Eigen::VectorXd priors = parameters.prior_information();
    if (!options.use_priors) priors.setZero();
    result.held_out_blocks = calibration::figures_of(as_list(calibration::held_out_distances(
        residuals, fit.linearisation.slope, priors, calibration::spatial_blocks(residuals))));
    if (measured_->held_out.empty()) return;
    calibration::MeasuredScene scene = measured_->fitted_scene();
    scene.measurements.clear();
    for (const calibration::Measurement& held_out : measured_->held_out) scene.measurements.push_back(&held_out);
    const simulation::Model model = parameters.model(result.fit.u);
    Evaluator other(scene, model);
    simulation::ChainSolution near = result.fit.prediction.solution;
    near.poses.assign(measured_->start.poses.begin() + static_cast<std::ptrdiff_t>(measured_->fitted.size()),
                      measured_->start.poses.end());
    const calibration::Prediction prediction = other.predict(model, &near);
    for (std::size_t m = 0; m < scene.measurements.size(); ++m) {
      calibration::Prediction one;
      one.poses.push_back(prediction.poses[m]);
      result.held_out_poses.push_back(
          {scene.measurements[m]->pose.name, one.mae_study_mm(), calibration::figures_of(one.scan_distances())});
    }
  }

  void write(Run& run, const FreeParameters& parameters, const CalibrationResult& result) const {
    const fs::path model_file = folder() / "model.toml", history_file = folder() / "history.csv";
    const fs::path temporary = run.output(model_file);
    fs::copy_file(measured_->model_file, temporary, fs::copy_options::overwrite_existing);
    if (parameters.base().effects.size() > measured_->model.effects.size()) {
      const std::string text = with_effect(temporary, simulation::place_of_scan().name());
      std::ofstream(temporary, std::ios::binary) << text;
    }
    std::map<std::string, double> values;
    for (Eigen::Index i = 0; i < parameters.size(); ++i)
      values[parameters.names()[static_cast<std::size_t>(i)]] = parameters.value(i, result.fit.u[i]);
    const std::string text = with_values(temporary, values);
    std::ofstream(temporary, std::ios::binary) << text;
    read_model(temporary);
    write_history(parameters, result.fit, run.output(history_file));
    auto figures = calibration_figures(*measured_, parameters, result);
    figures["profile_evaluations"] = profile_runs_;
    run.figures(folder() / "calibration.json") = figures;
    run.figures(model_file) = {{"fitted_from", measured_->model_file.filename().string()}};
    run.figures(history_file) = {{"rows", result.fit.history.size()}};
  }

  static void write_history(const FreeParameters& parameters, const Fit& fit, const fs::path& file) {
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

  Outcome judge_target(Run& run, const CalibrationResult& result) const {
    const double mae = result.fit.prediction.mae_study_mm();
    if (until_mae_ && !(mae <= *until_mae_)) {
      run.warn(fmt::format("the MAE model to scan is {:.3f} mm, above the {} mm of --until-mae", mae, *until_mae_));
      return Outcome::target_not_met;
    }
    if (result.fit.converged) return Outcome::done;
    run.warn(fmt::format("the fit stopped before it converged: {}", result.fit.message));
    return Outcome::target_not_met;
  }

  fs::path case_folder_, mesh_file_, model_file_;
  std::string method_ = "least-squares", intervals_ = "linear";
  std::optional<double> until_mae_;
  unsigned seed_ = 1;
  int starts_ = 1;
  double robust_mm_ = 5;
  int population_ = 0, max_evaluations_ = 300, map_ = 0;
  bool no_priors_ = false, scan_offset_ = false;
  int profile_runs_ = 0;
  std::unique_ptr<MeasuredCase> measured_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::CalibrateTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
