// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <fstream>

#include "cohort/page.h"
#include "cohort/results.h"
#include "common/error.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

class CohortTool : public Tool {
 public:
  std::string name() const override { return "supine-cohort"; }

  std::string summary() const override {
    return "What many patients say together: a table of all cases, moduli of the population, how common each effect is "
           "and "
           "whether one too weak for any single patient is there.\n"
           "Reads the results of the cases, runs none again. Writes cohort.csv (a row a patient), cohort.json and "
           "cohort.html (a page that needs no network). -o names "
           "their folder (default: the cohort's).\n\n"
           "Examples:\n"
           "  supine-cohort patients\n"
           "  supine-cohort patients --results elsewhere --shared-mm 0.2 -o pooled\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("cohort", cohort_, "folder of cases, each with a case.toml")->required();
    app.add_option("--results", results_, "where results are: RESULTS/NAME (default: COHORT/NAME/out)");
    app.add_option("--shared-mm", options_.shared_mm,
                   "the model's own error that all patients share, 1 sigma along an effect, mm RMS over the scan")
        ->check(within(0, 10))
        ->capture_default_str();
    app.add_option("--prior-probability", options_.prior_probability,
                   "of each effect, before anything is measured: that some patients have it")
        ->check(within(1e-6, 1 - 1e-6))
        ->capture_default_str();
  }

  Outcome run(Run& run) override {
    run.stage("read");
    const fs::path folder = output.empty() ? cohort_ : output;
    const fs::path csv = run.output(folder / "cohort.csv");
    const fs::path html = run.output(folder / "cohort.html");
    run.output(folder / "cohort.json");
    const auto cases = cohort::read_results(cohort_, results_);
    for (const auto& one : cases)
      for (const char* file : {"comparison.json", "calibration.json", "diagnosis.json"})
        if (fs::exists(one.out / file)) run.input(one.out / file);
    run.stage("pool");
    const auto figures = cohort::pooled(cases, options_);
    run.stage("write");
    std::ofstream stream(csv, std::ios::binary);
    stream << cohort::table_csv(cases);
    if (!stream.flush()) throw InputError("writing cohort.csv failed; check the free space on the disk");
    std::ofstream page(html, std::ios::binary);
    page << cohort::cohort_page(cases, figures, fs::weakly_canonical(cohort_).filename().string(), folder);
    if (!page.flush()) throw InputError("writing cohort.html failed; check the free space on the disk");
    run.figures(folder / "cohort.json") = figures;
    say(run, figures);
    return Outcome::done;
  }

 private:
  static void say(Run& run, const nlohmann::ordered_json& f) {
    run.say(fmt::format("  {} patients, {} diagnosed, {} set aside", f["patients"].get<int>(),
                        f["diagnosed"].get<int>(), f["set_aside"].size()));
    if (const int old = f["diagnosed_by_an_earlier_version"]; old > 0)
      run.warn(fmt::format(
          "{} diagnoses were made by an earlier version and say nothing of single effects; diagnose them again", old));
    if (const int old = f["calibrated_by_an_earlier_version"]; old > 0)
      run.warn(fmt::format(
          "{} calibrations were made by an earlier version, which does not tell measurement from prior; their moduli "
          "are not pooled, calibrate again",
          old));
    for (const auto& n : f["numbers"])
      run.say(fmt::format("  {:<32}{:>9.3g} [{:.3g}, {:.3g}] {} in the median, a factor of {:.2f} between patients",
                          n["name"].get<std::string>(), n["median"]["value"].get<double>(),
                          n["median"]["interval95"][0].get<double>(), n["median"]["interval95"][1].get<double>(),
                          n["unit"].get<std::string>(), std::exp(n["spread_ln"]["value"].get<double>())));
    for (const auto& e : f["effects"])
      run.say(fmt::format("  {:<32}{:>9.2f} that some have it; then {:.0f} % [{:.0f}, {:.0f}] of {} do",
                          e["effect"].get<std::string>(), e["probability"].get<double>(),
                          100 * e["share"]["value"].get<double>(), 100 * e["share"]["interval95"][0].get<double>(),
                          100 * e["share"]["interval95"][1].get<double>(), e["patients"].get<int>()));
  }

  fs::path cohort_, results_;
  cohort::PoolOptions options_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::CohortTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
