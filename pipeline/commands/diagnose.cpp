// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/diagnose.h"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>

#include "common/error.h"
#include "pipeline/picture/picture.h"
#include "pipeline/results/ladder_report.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

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
    app.add_option("--registration-mm", options_.known.registration_mm,
                   "how well each scan's place is known, 1 sigma per direction, mm; its turn goes with it, 0.75 "
                   "degrees per mm (default: registration_mm of the case, else 2). 0.3 where markers were used")
        ->check(within(0, 50));
    app.add_option("--segmentation-mm", options_.known.segmentation_mm,
                   "how well the imaged skin's place is known, 1 sigma, mm (default: segmentation_mm of the case, "
                   "else 0.3)")
        ->check(within(0, 50));
    app.add_option("--chest-wall-mm", options_.known.chest_wall_mm,
                   "how far breath may move the muscle between two scans, 1 sigma, mm (default: breath_mm of the "
                   "case, else 1)")
        ->check(within(0, 50));
    app.add_option("--prior", options_.prior_of_sets,
                   "probabilities, before anything is measured, that nothing, one, two and three effects are missing: "
                   "four numbers > 0 that add up to 1 (default: 0.5,0.3,0.15,0.05)")
        ->delimiter(',')
        ->expected(4);
    app.add_option(
           "--unlisted", options_.unlisted,
           "probability, before anything is measured, that tissue, skin or muscle is otherwise at some place in "
           "a way that no effect lists; 0 = that is not weighed")
        ->check(within(0, 0.9))
        ->capture_default_str();
    app.add_option(
           "--without", options_.without,
           "to see what a verdict rests on: examine as if there were no discrepancy (forces that nobody knows "
           "of), nuisances (places of scans, gravity, breath, ...), patchiness (uneven tissue, skin and muscle, "
           "local causes) or landmarks; several with commas between them")
        ->delimiter(',')
        ->check(CLI::IsMember({"discrepancy", "nuisances", "patchiness", "landmarks"}));
    app.add_flag("--ladder", ladder_,
                 "add what is missing, fit and examine again, until nothing is missing or three effects were added; "
                 "writes ladder.json and model.toml, the model as given with what was added and the fitted numbers");
    app.add_option("--seed", options_.seed, "of the draws behind the p values")->capture_default_str();
    declare_png(app, png_, "the model's skin coloured by its mean distance to the scan");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    options_.other_meshes = !no_other_meshes_;
    options_.check();
    check_model_target(run);
    announce_png(run, png_, folder() / "diagnosis.vtp");
    const CaseToDiagnose subject =
        measure_to_diagnose(run, read_case_inputs(run, case_folder_, mesh_file_, model()), options_.without);
    const MeasuredCase& measured = *subject.measured;
    LiveProgress live(run, std::chrono::seconds(0));
    const diagnosis::ExamineOptions options = examine_options(subject, options_, live);
    const DiagnosisResult result = diagnose(run, subject, options, live);
    run.stage("write");
    write_diagnosis_files(run, measured, result, folder());
    run.figures(folder() / "diagnosis.vtp").update(diagnosis_figures(result));
    if (!png_.empty()) draw(run, measured);
    say_diagnosis(run, result);
    if (ladder_) {
      run.stage("ladder");
      const auto ladder = diagnosis::climb(subject.subject(), options, *result.found);
      run.figures(folder() / "ladder.json") = ladder_figures(ladder);
      write_models(run, ladder, measured.model_text);
      say_ladder(run, ladder);
    }
    return Outcome::done;
  }

 private:
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
  void write_models(Run& run, const diagnosis::Ladder& ladder, const ModelText& given) const {
    const auto write = [&](std::size_t rung, const fs::path& file) {
      std::ofstream(run.output(file), std::ios::binary) << rung_model(ladder, rung, given).text;
      run.figures(file) = {{"fitted_from", given.file.filename().string()}};
    };
    write(ladder.rungs.size() - 1, folder() / "model.toml");
    for (std::size_t rung = 1; rung < ladder.rungs.size(); ++rung)
      write(rung, folder() / std::to_string(rung) / "model.toml");
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
  DiagnoseOptions options_;
  bool no_other_meshes_ = false, ladder_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::DiagnoseTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
