// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <cmath>
#include <fstream>

#include "calibration/evaluator_pool.h"
#include "calibration/monte_carlo.h"
#include "common/error.h"
#include "common/statistics.h"
#include "pipeline/case/journal_key.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/picture/picture.h"

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
           "(default: the folder of the mesh). Interrupted, it goes on where it was.\n\n"
           "Examples:\n"
           "  supine-sensitivity mycase mycase/out/mesh.vtu --samples 1000\n"
           "  supine-sensitivity mycase mycase/out/mesh.vtu --law normal --seed 7 -o normal.csv\n";
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
    declare_png(app, png_, "a histogram of the error with its quantiles");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    const fs::path target = target_file();
    run.output(target);  // before the work, so that nobody waits for what cannot be written
    announce_png(run, png_, target);
    measured_ = read_measured_case(run, case_folder_, mesh_file_, model_file_);
    const FreeParameters parameters(measured_->model);
    const DrawKind kind = law_ == "normal" ? DrawKind::normal : DrawKind::prior;
    const calibration::Draws draws = calibration::draw_parameters(parameters, kind, samples_, seed_);
    if (draws.refused > 0)
      run.warn(
          fmt::format("{} of {} draws lay outside the range of a parameter (with the normal law mostly negative "
                      "moduli) and were refused; the sample is that of the law cut at the ranges",
                      draws.refused, samples_ + draws.refused));
    run.stage("runs");
    const std::vector<RunResult> results = simulate(run, parameters, draws, target);
    run.stage("write");
    write(run, target, parameters, draws, results);
    return Outcome::done;
  }

 private:
  fs::path target_file() const {
    if (output.extension() == ".csv") return output;
    return (output.empty() ? mesh_file_.parent_path() : output) / "sensitivity.csv";
  }

  std::vector<RunResult> simulate(Run& run, const FreeParameters& parameters, const calibration::Draws& draws,
                                  const fs::path& target) const {
    calibration::RunJournal journal(fs::path(target).replace_extension(".runs"),
                                    journal_key(*measured_, case_folder_, mesh_file_));
    if (journal.known() > 0) run.say(fmt::format("  going on after {} chain runs", journal.known()));
    calibration::EvaluatorPool pool(measured_->fitted_scene(), parameters, measured_->start, run.threads());
    LiveProgress live(run);
    std::size_t finished = journal.known();
    int failed = 0;
    const auto results = pool.run(draws.values, journal, [&](const RunResult& result) {
      failed += result.failed;
      live.show(fmt::format("run {} of {}, {} without equilibrium", ++finished, draws.values.size(), failed));
    });
    run.no_longer_needed(journal.file());
    return results;
  }

  void write(Run& run, const fs::path& target, const FreeParameters& parameters, const calibration::Draws& draws,
             const std::vector<RunResult>& results) const {
    std::ofstream stream(run.output(target), std::ios::binary);
    stream << "sample";
    for (const std::string& name : parameters.names()) stream << "," << name;
    stream << ",mae_study_mm,mae_mm,rms_mm,failed\n";
    std::vector<double> mae;
    std::vector<Eigen::Index> rows;
    for (std::size_t i = 0; i < results.size(); ++i) {
      const RunResult& r = results[i];
      stream << i + 1;
      for (const double value : draws.values[i]) stream << "," << fmt::format("{}", value);
      if (r.failed) {
        stream << ",,,,1\n";
        continue;
      }
      stream << fmt::format(",{},{},{},0\n", r.mae_study_mm, r.mae_mm, r.rms_mm);
      mae.push_back(r.mae_study_mm);
      rows.push_back(static_cast<Eigen::Index>(i));
    }
    if (!stream.flush()) throw InputError("writing sensitivity.csv failed; check the free space on the disk");
    Eigen::MatrixXd values(rows.size(), parameters.size());
    for (std::size_t i = 0; i < rows.size(); ++i)
      values.row(static_cast<Eigen::Index>(i)) = draws.values[static_cast<std::size_t>(rows[i])].transpose();
    report(run, target, parameters, draws, values, mae);
  }

  void report(Run& run, const fs::path& target, const FreeParameters& parameters, const calibration::Draws& draws,
              const Eigen::MatrixXd& values, const std::vector<double>& mae) const {
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
