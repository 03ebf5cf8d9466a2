// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/sensitivity.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "calibration/evaluator_pool.h"
#include "common/error.h"
#include "common/statistics.h"
#include "simulation/parameters.h"

namespace supine::pipeline {

using calibration::DrawKind;
using calibration::Draws;
using calibration::FreeParameters;
using Json = nlohmann::ordered_json;

namespace {

constexpr double quantiles[] = {0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975};

}  // namespace

void check_laws(const FreeParameters& parameters, const std::filesystem::path& file) {
  simulation::Model model = parameters.base();
  for (const std::string& name : parameters.names()) {
    const simulation::Setting& setting = *simulation::find_setting(model, name);
    if (!setting.prior_sd)
      throw InputError(
          fmt::format("{}: {} is free and has no prior_sd, so there is no law to draw it from; give it one, as in "
                      "{{ value = {}, prior_sd = {} }}, or fix it: {}",
                      file.string(), name, setting.value, 0.5 * std::abs(setting.value), setting.value));
  }
}

Draws draw(Run& run, const FreeParameters& parameters, const std::string& law, int count, unsigned seed) {
  if (law != "prior" && law != "normal") throw InputError(fmt::format("law = {}: must be prior or normal", law));
  Draws draws =
      calibration::draw_parameters(parameters, law == "normal" ? DrawKind::normal : DrawKind::prior, count, seed);
  if (draws.refused > 0)
    run.warn(
        fmt::format("{} of {} draws lay outside the range of a parameter (with the normal law mostly negative "
                    "moduli) and were refused; the sample is that of the law cut at the ranges",
                    draws.refused, count + draws.refused));
  return draws;
}

SensitivityRows run_draws(Run& run, const MeasuredCase& measured, const FreeParameters& parameters, const Draws& draws,
                          const DrawRange& range, calibration::RunJournal& journal) {
  measured.check_covers_skin("supine-sensitivity");
  SensitivityRows rows{
      range, {draws.values.begin() + static_cast<std::ptrdiff_t>(range.first), draws.values.end()}, {}};
  if (journal.known() > 0) run.say(fmt::format("  going on after {} chain runs", journal.known()));
  calibration::EvaluatorPool pool(measured.fitted_scene(), parameters, measured.start, run.threads());
  LiveProgress live(run);
  std::size_t finished = journal.known();
  int failed = 0;
  rows.results = pool.run(rows.values, journal, [&](const calibration::RunResult& result) {
    failed += result.failed;
    live.show(fmt::format("run {} of {}, {} without equilibrium", ++finished, range.count(), failed));
  });
  return rows;
}

Json sensitivity_figures(const FreeParameters& parameters, const std::string& law, const Draws& draws,
                         const SensitivityRows& rows) {
  const auto& [values, mae] = solved_draws(rows, parameters.size());
  const auto samples = rows.range.count();
  if (mae.size() < 2)
    throw NumericalFailure(
        fmt::format("{} of {} draws had an equilibrium; narrow prior_sd or raise the moduli", mae.size(), samples));
  const Eigen::Map<const Eigen::VectorXd> m(mae.data(), static_cast<Eigen::Index>(mae.size()));
  const double sd = std::sqrt((m.array() - m.mean()).square().sum() / static_cast<double>(m.size() - 1));
  const bool shared_out = mae.size() >= static_cast<std::size_t>(least_samples);
  const Eigen::VectorXd shares =
      shared_out ? calibration::first_order_shares(values, m) : Eigen::VectorXd::Zero(parameters.size());
  Json f;
  f["samples"] = samples;
  f["law"] = law;
  f["refused_draws"] = draws.refused;
  f["failed_solves"] = samples - mae.size();
  f["mae_study_mm"] = {{"mean", m.mean()}, {"sd", sd}, {"min", m.minCoeff()}, {"max", m.maxCoeff()}};
  f["quantiles"] = Json::array();
  for (const double q : quantiles) f["quantiles"].push_back({{"share", q}, {"mae_study_mm", quantile(mae, q)}});
  f["parameters"] = Json::array();
  for (Eigen::Index p = 0; p < parameters.size(); ++p)
    f["parameters"].push_back({{"name", parameters.names()[static_cast<std::size_t>(p)]},
                               {"unit", parameters.unit(p)},
                               {"median", quantile({values.col(p).begin(), values.col(p).end()}, 0.5)},
                               {"variance_share", shared_out ? Json(shares[p]) : Json(nullptr)}});
  f["interaction_share"] = shared_out ? Json(std::max(0.0, 1 - shares.sum())) : Json(nullptr);
  return f;
}

}  // namespace supine::pipeline
