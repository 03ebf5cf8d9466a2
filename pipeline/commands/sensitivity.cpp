// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/sensitivity.h"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>

#include "common/error.h"
#include "common/statistics.h"
#include "pipeline/case/journal_key.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/case/population_priors.h"
#include "pipeline/picture/picture.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using calibration::FreeParameters;
using Json = nlohmann::ordered_json;

class SensitivityTool : public Tool {
 public:
  std::string name() const override { return "supine-sensitivity"; }

  std::string summary() const override {
    return "Draws the free parameters from what the model believes of them (value, prior_sd) and runs the chain for "
           "each draw: how much does the error depend on them, and on which?\n"
           "Writes sensitivity.csv (a row per draw) and sensitivity.json. -o names the CSV file or its folder "
           "(default: the folder of the mesh). Interrupted, it goes on where it was. Draws may be run in parts, "
           "anywhere, and merged to the same bytes.\n\n"
           "Examples:\n"
           "  supine-sensitivity mycase mycase/out/mesh.vtu --samples 1000\n"
           "  supine-sensitivity mycase mycase/out/mesh.vtu --law normal --seed 7 -o normal.csv\n"
           "  supine-sensitivity mycase mycase/out/mesh.vtu --draws 250:500 -o parts/250-500.csv\n"
           "  supine-sensitivity mycase mycase/out/mesh.vtu --samples 500 --merge parts/0-250.csv parts/250-500.csv\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("mesh", mesh_file_, "imaged mesh, as supine-tetrahedralise writes it (.vtu)")->required();
    app.add_option("--model", model_file_, "whose free parameters are drawn (default: CASE/model.toml)");
    app.add_option(
           "--samples", samples_,
           fmt::format("draws, at least {}; chance alone gives a parameter a share of the variance of 0.2 with 10 "
                       "draws, 0.04 with 100, 0.01 with 1000 (1 sigma)",
                       least_samples))
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    app.add_option("--law", law_,
                   "prior: log-normal with median value and log-sd ln(1 + prior_sd/value), never negative; normal: the "
                   "study's, mean value and standard deviation prior_sd, what is drawn outside the range is refused")
        ->check(CLI::IsMember({"prior", "normal"}))
        ->capture_default_str();
    app.add_option("--seed", seed_, "of the draws")->capture_default_str();
    auto* merge = app.add_option("--merge", parts_,
                                 "no runs: put together what --draws wrote; every draw of --samples must be there");
    auto* part = app.add_option("--draws", draws_,
                                "A:B, only the draws from A on up to but without B, counted from 0; no statistics")
                     ->excludes(merge);
    part->excludes(app.get_option("--samples"));
    declare_png(app, png_, "a histogram of the error with its quantiles");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    if (draws_.empty() && samples_ < least_samples)
      throw InputError(fmt::format("--samples {}: must be at least {}: shares of the variance compare classes of draws",
                                   samples_, least_samples));
    const fs::path target = target_file();
    run.output(target);  // before the work, so that nobody waits for what cannot be written
    if (draws_.empty()) announce_png(run, png_, target);
    const DrawRange range =
        draws_.empty() ? DrawRange{0, static_cast<std::size_t>(samples_)} : parse_draw_range(draws_);
    if (range.end > most_samples) throw InputError(fmt::format("--draws {}: at most {} draws", draws_, most_samples));
    CaseInputs inputs = read_case_inputs(run, case_folder_, mesh_file_, model_file_);
    const FreeParameters parameters(with_population(run, inputs.description, inputs.model));
    check_laws(parameters, inputs.model_text.file);
    measured_ = measure_case(run, std::move(inputs));
    measured_->check_covers_skin(name());  // before a journal is begun
    const auto draws = draw(run, parameters, law_, static_cast<int>(range.end), seed_);
    run.stage("runs");
    const SensitivityRows rows =
        parts_.empty() ? simulate(run, parameters, draws, range, target) : merge(parameters, draws);
    run.stage("write");
    std::ofstream stream(run.output(target), std::ios::binary);
    write_sensitivity(rows, parameters.names(), stream);
    if (draws_.empty())
      report(run, target, parameters, draws, rows);
    else
      report_part(run, target, rows);
    return Outcome::done;
  }

 private:
  static constexpr std::size_t most_samples = 1000000;

  fs::path target_file() const {
    if (output.extension() == ".csv") return output;
    return (output.empty() ? mesh_file_.parent_path() : output) / "sensitivity.csv";
  }

  /// What every run depends on besides its own numbers: parts of another are not merged.
  std::string depends_on() const { return journal_key(*measured_, case_folder_, mesh_file_); }

  SensitivityRows simulate(Run& run, const FreeParameters& parameters, const calibration::Draws& draws,
                           const DrawRange& range, const fs::path& target) const {
    calibration::RunJournal journal(fs::path(target).replace_extension(".runs"), depends_on());
    SensitivityRows rows = run_draws(run, *measured_, parameters, draws, range, journal);
    run.no_longer_needed(journal.file());
    return rows;
  }

  SensitivityRows merge(const FreeParameters& parameters, const calibration::Draws& draws) const {
    std::vector<std::pair<fs::path, SensitivityRows>> parts;
    for (const fs::path& file : parts_) {
      parts.emplace_back(file, read_sensitivity(file, parameters.names()));
      const fs::path sidecar = fs::path(file).replace_extension(".json");
      std::ifstream stream(sidecar);
      const Json said = Json::parse(stream, nullptr, false);
      if (said.is_discarded() || said.value("depends_on", "") != depends_on())
        throw InputError(fmt::format(
            "{}: the part was not made by this program from this case, model, mesh and scans; make it again with "
            "--draws {}:{}",
            sidecar.string(), parts.back().second.range.first, parts.back().second.range.end));
    }
    return merge_sensitivity(std::move(parts), draws.values);
  }

  void report_part(Run& run, const fs::path& target, const SensitivityRows& rows) const {
    const auto failed = std::count_if(rows.results.begin(), rows.results.end(),
                                      [](const calibration::RunResult& r) { return r.failed; });
    Json& f = run.figures(target);
    f["draws"] = {rows.range.first, rows.range.end};
    f["law"] = law_;
    f["failed_solves"] = failed;
    f["depends_on"] = depends_on();
    run.say(fmt::format("  draws {} to {}: {} chain runs, {} without equilibrium", rows.range.first, rows.range.end - 1,
                        rows.range.count(), failed));
  }

  void report(Run& run, const fs::path& target, const FreeParameters& parameters, const calibration::Draws& draws,
              const SensitivityRows& rows) const {
    run.figures(target) = sensitivity_figures(parameters, law_, draws, rows);
    const std::vector<double> mae = solved_draws(rows, parameters.size()).mae_study_mm;
    const int failed = samples_ - static_cast<int>(mae.size());
    if (!png_.empty())
      draw_histogram(
          {fmt::format("{}: {} draws, {} without equilibrium", measured_->description.name, samples_, failed),
           "MAE model to scan, mm",
           mae,
           {{"5 %", quantile(mae, 0.05)}, {"median", quantile(mae, 0.5)}, {"95 %", quantile(mae, 0.95)}}},
          run.output(png_));
    say(run, mae, run.figures(target));
  }

  static void say(const Run& run, const std::vector<double>& mae, const Json& f) {
    run.say(
        fmt::format("  {} chain runs, {} without equilibrium", f["samples"].get<int>(), f["failed_solves"].get<int>()));
    run.say(fmt::format(
        "  MAE model to scan (study): {:.2f} ± {:.2f} mm (mean, sd); 5 % {:.2f}, median {:.2f}, 95 % {:.2f}",
        f["mae_study_mm"]["mean"].get<double>(), f["mae_study_mm"]["sd"].get<double>(), quantile(mae, 0.05),
        quantile(mae, 0.5), quantile(mae, 0.95)));
    if (f["interaction_share"].is_null())
      return run.say(
          fmt::format("  too few draws had an equilibrium to share the variance out, {} are needed", least_samples));
    for (const Json& parameter : f["parameters"])
      run.say(fmt::format("  {:>5.1f} % of the variance from {}", 100 * parameter["variance_share"].get<double>(),
                          parameter["name"].get<std::string>()));
    if (f["parameters"].size() > 1)
      run.say(
          fmt::format("  {:>5.1f} % from the parameters acting together", 100 * f["interaction_share"].get<double>()));
  }

  fs::path case_folder_, mesh_file_, model_file_, png_;
  std::vector<fs::path> parts_;
  std::string draws_;
  int samples_ = 1000;
  std::string law_ = "prior";
  unsigned seed_ = 1;
  std::unique_ptr<MeasuredCase> measured_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::SensitivityTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
