// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "calibration/evaluator_pool.h"
#include "calibration/monte_carlo.h"
#include "common/error.h"
#include "common/statistics.h"
#include "pipeline/case/journal_key.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/case/population_priors.h"
#include "pipeline/picture/picture.h"
#include "pipeline/results/sensitivity_table.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using calibration::DrawKind;
using calibration::FreeParameters;
using calibration::RunResult;
using Json = nlohmann::ordered_json;

constexpr double quantiles[] = {0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975};

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
    app.add_option("--samples", samples_, "chain runs")->check(CLI::Range(1, 1000000))->capture_default_str();
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
    const fs::path target = target_file();
    run.output(target);  // before the work, so that nobody waits for what cannot be written
    if (draws_.empty()) announce_png(run, png_, target);
    const DrawRange range =
        draws_.empty() ? DrawRange{0, static_cast<std::size_t>(samples_)} : parse_draw_range(draws_);
    if (range.end > most_samples) throw InputError(fmt::format("--draws {}: at most {} draws", draws_, most_samples));
    measured_ = read_measured_case(run, case_folder_, mesh_file_, model_file_);
    measured_->check_covers_skin(name());
    const FreeParameters parameters(with_population(run, measured_->description, measured_->model));
    const DrawKind kind = law_ == "normal" ? DrawKind::normal : DrawKind::prior;
    const auto draws = calibration::draw_parameters(parameters, kind, static_cast<int>(range.end), seed_);
    if (draws.refused > 0)
      run.warn(
          fmt::format("{} of {} draws lay outside the range of a parameter (with the normal law mostly negative "
                      "moduli) and were refused; the sample is that of the law cut at the ranges",
                      draws.refused, range.end + static_cast<std::size_t>(draws.refused)));
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
    SensitivityRows rows{
        range, {draws.values.begin() + static_cast<std::ptrdiff_t>(range.first), draws.values.end()}, {}};
    calibration::RunJournal journal(fs::path(target).replace_extension(".runs"),
                                    journal_key(*measured_, case_folder_, mesh_file_));
    if (journal.known() > 0) run.say(fmt::format("  going on after {} chain runs", journal.known()));
    calibration::EvaluatorPool pool(measured_->fitted_scene(), parameters, measured_->start, run.threads());
    LiveProgress live(run);
    std::size_t finished = journal.known();
    int failed = 0;
    rows.results = pool.run(rows.values, journal, [&](const RunResult& result) {
      failed += result.failed;
      live.show(fmt::format("run {} of {}, {} without equilibrium", ++finished, range.count(), failed));
    });
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
    const auto failed =
        std::count_if(rows.results.begin(), rows.results.end(), [](const RunResult& r) { return r.failed; });
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
    const auto& [values, mae] = solved_draws(rows, parameters.size());
    const int failed = samples_ - static_cast<int>(mae.size());
    if (mae.size() < 2)
      throw NumericalFailure(
          fmt::format("{} of {} draws had an equilibrium; narrow prior_sd or raise the moduli", mae.size(), samples_));
    const Eigen::Map<const Eigen::VectorXd> m(mae.data(), static_cast<Eigen::Index>(mae.size()));
    const double sd = std::sqrt((m.array() - m.mean()).square().sum() / static_cast<double>(m.size() - 1));
    const Eigen::VectorXd shares = calibration::first_order_shares(values, m);
    Json& f = run.figures(target);
    f["samples"] = samples_;
    f["law"] = law_;
    f["refused_draws"] = draws.refused;
    f["failed_solves"] = failed;
    f["mae_study_mm"] = {{"mean", m.mean()}, {"sd", sd}, {"min", m.minCoeff()}, {"max", m.maxCoeff()}};
    f["quantiles"] = Json::array();
    for (const double q : quantiles) f["quantiles"].push_back({{"share", q}, {"mae_study_mm", quantile(mae, q)}});
    f["parameters"] = Json::array();
    for (Eigen::Index p = 0; p < parameters.size(); ++p)
      f["parameters"].push_back({{"name", parameters.names()[static_cast<std::size_t>(p)]},
                                 {"unit", parameters.unit(p)},
                                 {"median", quantile({values.col(p).begin(), values.col(p).end()}, 0.5)},
                                 {"variance_share", shares[p]}});
    f["interaction_share"] = std::max(0.0, 1 - shares.sum());
    if (!png_.empty())
      draw_histogram(
          {fmt::format("{}: {} draws, {} without equilibrium", measured_->description.name, samples_, failed),
           "MAE model to scan, mm",
           mae,
           {{"5 %", quantile(mae, 0.05)}, {"median", quantile(mae, 0.5)}, {"95 %", quantile(mae, 0.95)}}},
          run.output(png_));
    say(run, parameters, mae, {m.mean(), sd}, shares, failed);
  }

  void say(const Run& run, const FreeParameters& parameters, const std::vector<double>& mae,
           const std::pair<double, double>& mean_and_sd, const Eigen::VectorXd& shares, int failed) const {
    run.say(fmt::format("  {} chain runs, {} without equilibrium", samples_, failed));
    run.say(fmt::format(
        "  MAE model to scan (study): {:.2f} ± {:.2f} mm (mean, sd); 5 % {:.2f}, median {:.2f}, 95 % {:.2f}",
        mean_and_sd.first, mean_and_sd.second, quantile(mae, 0.05), quantile(mae, 0.5), quantile(mae, 0.95)));
    for (Eigen::Index p = 0; p < shares.size(); ++p)
      run.say(fmt::format("  {:>5.1f} % of the variance from {}", 100 * shares[p],
                          parameters.names()[static_cast<std::size_t>(p)]));
    run.say(fmt::format("  {:>5.1f} % from the parameters acting together", 100 * std::max(0.0, 1 - shares.sum())));
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
