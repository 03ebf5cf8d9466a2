// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "common/error.h"
#include "diagnosis/range_ends.h"
#include "pipeline/case/case_priors.h"
#include "pipeline/case/model_file.h"
#include "pipeline/case/population_priors.h"
#include "pipeline/picture/picture.h"
#include "pipeline/results/diagnosis_report.h"
#include "pipeline/results/ladder_report.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"
#include "simulation/solve/equilibrium.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

void warn_of_missing_mesh(Run& run, const diagnosis::NumericalError& error) {
  if (error.finer_failure.empty() && error.coarser_failure.empty()) return;
  const bool both = error.finer_failure == error.coarser_failure;
  const std::string& why = error.finer_failure.empty() ? error.coarser_failure : error.finer_failure;
  run.warn(fmt::format("the error of the mesh could not be measured: {} ({}). It is taken to be {:.1f} mm",
                       both                          ? "no other mesh gives an answer"
                       : error.finer_failure.empty() ? "a coarser surface gives no answer"
                                                     : "better elements give no answer",
                       why, error.spread_mm));
}

/// What no measurement errs by is no finding but a wrong file.
void refuse_wrong_input(const Case& description, const std::vector<diagnosis::MeasurementAtEnd>& ends) {
  if (ends.empty()) return;
  std::vector<std::string> scans, numbers;
  for (const Pose& pose : description.poses)
    if (pose.surface) scans.push_back(fmt::format("{} ([pose.{}])", pose.surface->filename().string(), pose.name));
  for (const auto& end : ends) {
    const simulation::Effect& effect = *simulation::find_effect(end.name.substr(0, end.name.find('.')));
    numbers.push_back(
        fmt::format("{} = {:.3g} {} ({}; bound {:g})", end.name, end.value, end.unit, effect.meaning(), end.bound));
  }
  throw InputError(
      fmt::format("{}: fits best with an error of measurement at the end of its range: {}. Nothing is measured so "
                  "wrong: check surface and "
                  "gravity of [pose.*], [case] side and frame, the scan's axes and unit, and the labels; a scan that "
                  "lies elsewhere is "
                  "laid on the body by supine-register",
                  fmt::join(scans, ", "), fmt::join(numbers, ", ")));
}

class DiagnoseTool : public Tool {
 public:
  std::string name() const override { return "supine-diagnose"; }

  std::string summary() const override {
    return "Asks what a calibrated model lacks: where it is off, which effect of the catalogue would take that away, "
           "how sure that is, what this scan cannot show and what to measure next.\n"
           "Writes diagnosis.json, diagnosis.vtp (scan points with the shape of each effect) and error_map_POSE.vtp "
           "(the model's skin). -o names their folder (default: that of the mesh; with --ladder its subfolder "
           "ladder).\n\n"
           "Examples:\n"
           "  supine-diagnose mycase mycase/out/mesh.vtu\n"
           "  supine-diagnose mycase mycase/out/mesh.vtu --model mycase/out/model.toml -o trial\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("mesh", mesh_file_, "imaged mesh, as supine-tetrahedralise writes it (.vtu)")->required();
    app.add_option("--model", model_file_,
                   "calibrated model (default: model.toml beside the mesh, as supine-calibrate writes it)");
    app.add_option("--refit", options_.refits,
                   "the N likeliest sets of effects are followed through the whole chain, at most; 0 = straight lines")
        ->check(CLI::Range(0, 100))
        ->capture_default_str();
    app.add_flag("--no-other-meshes", no_other_meshes_,
                 "do not solve on other meshes: the mesh is then taken to be exact");
    app.add_option("--registration-mm", known_.registration_mm,
                   "how well each scan's place is known, 1 sigma per direction, mm; its turn goes with it, 0.75 "
                   "degrees per mm (default: registration_mm of the case, else 2). 0.3 where markers were used")
        ->check(not_below_zero());
    app.add_option("--segmentation-mm", known_.segmentation_mm,
                   "how well the imaged skin's place is known, 1 sigma, mm (default: segmentation_mm of the case, "
                   "else 0.3)")
        ->check(not_below_zero());
    app.add_option("--chest-wall-mm", known_.chest_wall_mm,
                   "how far breath may move the muscle between two scans, 1 sigma, mm (default: breath_mm of the "
                   "case, else 1)")
        ->check(not_below_zero());
    app.add_option("--prior", prior_of_sets_,
                   "probabilities, before anything is measured, that nothing, one, two and three effects are missing: "
                   "four numbers > 0 that add up to 1 (default: 0.5,0.3,0.15,0.05)")
        ->delimiter(',')
        ->expected(4);
    app.add_flag("--ladder", ladder_,
                 "add what is missing, fit and examine again, until nothing is missing or three effects were added; "
                 "writes ladder.json and model.toml, the model as given with what was added and the fitted numbers");
    app.add_option("--seed", options_.seed, "of the draws behind the p values")->capture_default_str();
    declare_png(app, png_, "the model's skin coloured by its mean distance to the scan");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    check_prior();
    check_model_target(run);
    announce_png(run, png_, folder() / "diagnosis.vtp");
    const auto measured = read_case_to_diagnose(run);
    calibration::Evaluator evaluator(measured->whole_scene(), measured->model);
    const std::vector<double> noise = measured->noise_mm(evaluator);
    run.stage("examine");
    LiveProgress live(run, std::chrono::seconds(0));
    options_.other_meshes = !no_other_meshes_;
    options_.priors = case_priors(measured->description, known_);
    options_.priors.patchiness = read_patchiness(own_model(measured->model) ? case_folder_ / "model.toml" : model());
    if (!prior_of_sets_.empty())
      std::copy(prior_of_sets_.begin(), prior_of_sets_.end(), options_.priors.of_sets.begin());
    options_.progress = [&live](const std::string& what) { live.show(what); };
    const simulation::Model given = given_model(run, *measured);
    auto found = diagnosis::examine(subject_of(*measured, given, noise), options_);
    refuse_wrong_input(measured->description, diagnosis::measurements_at_end(*found));
    if (!found->base.numerical)
      run.warn("the mesh is taken to be exact (--no-other-meshes)");
    else
      warn_of_missing_mesh(run, *found->base.numerical);
    run.stage("next measurement");
    live.show("further measurements");
    const DiagnosisResult result = complete(*measured, std::move(found));
    run.stage("write");
    write_diagnosis_files(run, *measured, result, folder());
    run.figures(folder() / "diagnosis.vtp").update(diagnosis_figures(result));
    if (!png_.empty()) draw(run, *measured);
    say_diagnosis(run, result);
    if (ladder_) {
      run.stage("ladder");
      const auto ladder = diagnosis::climb(subject_of(*measured, given, noise), options_, *result.found);
      run.figures(folder() / "ladder.json") = ladder_figures(ladder);
      write_models(run, ladder, measured->model_file);
      say_ladder(run, ladder);
    }
    return Outcome::done;
  }

 private:
  /// With the calibrated model, or where that carries the body no more, as a fit to a scan out of place may end, with
  /// the case's own.
  std::unique_ptr<MeasuredCase> read_case_to_diagnose(Run& run) const {
    const fs::path calibrated = model(), own = case_folder_ / "model.toml";
    try {
      return read_measured_case(run, case_folder_, mesh_file_, calibrated);
    } catch (const simulation::NoEquilibrium& failure) {
      if (!own_model(read_model(calibrated)) || fs::equivalent(own, calibrated)) throw;
      run.warn(fmt::format("{} has no equilibrium, the fit begins with {} instead ({})", calibrated.string(),
                           own.string(), failure.what()));
      return read_measured_case(run, case_folder_, mesh_file_, own);
    }
  }

  /// The case's own model, where it has the same effects and free numbers.
  std::optional<simulation::Model> own_model(const simulation::Model& calibrated) const {
    const fs::path file = case_folder_ / "model.toml";
    if (!fs::exists(file)) return std::nullopt;
    const simulation::Model own = read_model(file);
    const auto same_effect = [](const auto& a, const auto& b) { return a.name == b.name && a.options == b.options; };
    if (simulation::free_parameters(own) != simulation::free_parameters(calibrated) ||
        !std::equal(own.effects.begin(), own.effects.end(), calibrated.effects.begin(), calibrated.effects.end(),
                    same_effect))
      return std::nullopt;
    return own;
  }

  /// Where priors stand: the calibrated model, with each free number as the case's own model has it, if free there.
  simulation::Model given_model(Run& run, const MeasuredCase& measured) const {
    simulation::Model given = measured.model;
    if (const fs::path file = case_folder_ / "model.toml"; fs::exists(file)) {
      simulation::Model own = read_model(file);
      run.input(file);
      for (const std::string& name : simulation::free_parameters(given))
        if (const simulation::Setting* prior = simulation::find_setting(own, name); prior && prior->free)
          *simulation::find_setting(given, name) = *prior;
    }
    return with_population(run, measured.description, std::move(given));
  }

  fs::path model() const {
    if (!model_file_.empty()) return model_file_;
    const fs::path beside = mesh_file_.parent_path() / "model.toml";
    if (!fs::exists(beside))
      throw InputError(fmt::format(
          "{} is not there: a diagnosis starts from a calibrated model. Run supine-calibrate first, or name a model "
          "with --model",
          beside.string()));
    return beside;
  }

  fs::path folder() const {
    if (!output.empty()) return output;
    return ladder_ ? mesh_file_.parent_path() / "ladder" : mesh_file_.parent_path();
  }

  /// The error map of the first pose that the model was fitted to.
  void draw(Run& run, const MeasuredCase& measured) const {
    const std::string pose = measured.fitted.front().pose.name;
    const auto& figures = run.figures(folder() / "diagnosis.vtp");
    std::string verdict = figures.at("verdict");
    for (const auto& effect : figures.at("missing")) verdict += " " + effect.get<std::string>();
    std::replace(verdict.begin(), verdict.end(), '_', ' ');
    draw_distances(run.output(folder() / ("error_map_" + pose + ".vtp")),
                   fmt::format("{}, {}: {}", measured.description.name, pose, verdict), measured.description.side,
                   run.output(png_));
  }

  /// The model it ends with, and that of every rung in a folder of its own, where its shapes find room.
  void write_models(Run& run, const diagnosis::Ladder& ladder, const fs::path& read_from) const {
    const auto write = [&](std::size_t rung, const fs::path& file) {
      write_rung_model(ladder, rung, read_from, run.output(file));
      run.figures(file) = {{"fitted_from", read_from.filename().string()}};
    };
    write(ladder.rungs.size() - 1, folder() / "model.toml");
    for (std::size_t rung = 1; rung < ladder.rungs.size(); ++rung)
      write(rung, folder() / std::to_string(rung) / "model.toml");
  }

  void check_prior() const {
    constexpr double rounding = 1e-6;
    if (prior_of_sets_.empty()) return;
    const double sum = std::accumulate(prior_of_sets_.begin(), prior_of_sets_.end(), 0.0);
    const bool positive = std::all_of(prior_of_sets_.begin(), prior_of_sets_.end(), [](double p) { return p > 0; });
    if (!positive || std::abs(sum - 1) > rounding)
      throw InputError(fmt::format(
          "--prior {}: must be four numbers > 0 that add up to 1 (these: {}), of nothing, one, two and three effects",
          fmt::join(prior_of_sets_, ","), sum));
  }

  /// A ladder takes a minute: that its model cannot be written is better known before.
  void check_model_target(const Run& run) const {
    const fs::path target = folder() / "model.toml";
    if (ladder_ && !run.force() && fs::exists(target))
      throw InputError(
          fmt::format("{} exists already and --ladder writes the model it ends with there; name another "
                      "folder with -o, or replace it with --force",
                      target.string()));
  }

  fs::path case_folder_, mesh_file_, model_file_, png_;
  KnownOptions known_;
  std::vector<double> prior_of_sets_;
  diagnosis::ExamineOptions options_;
  bool no_other_meshes_ = false, ladder_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::DiagnoseTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
