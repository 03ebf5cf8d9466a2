// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/ladder_report.h"

#include <fmt/core.h>

#include <map>

#include "calibration/free_parameters.h"
#include "pipeline/case/model_edit.h"

namespace supine::pipeline {
namespace {

using diagnosis::RungFigures;
using Json = nlohmann::ordered_json;

Json figures_json(const RungFigures& r) {
  return {{"added", r.added}, {"mae_mm", r.mae_mm}, {"rms_mm", r.rms_mm}, {"held_out_rms_mm", r.held_out_rms_mm}};
}

Json or_null(const std::optional<RungFigures>& figures) { return figures ? figures_json(*figures) : Json(nullptr); }

Json rung_json(const diagnosis::Rung& rung) {
  Json json = figures_json(rung);
  json["probability"] = rung.probability;
  json["p_value"] = rung.p_value;
  json["unexplained_mm"] = rung.left.mean_mm;
  json["unexplained95"] = {rung.left.low_mm, rung.left.high_mm};
  if (!rung.added.empty())
    json["controls"] = {{"refit_only", or_null(rung.refit_only)}, {"random_other", or_null(rung.random_other)}};
  return json;
}

/// Names and values of what is free.
std::map<std::string, double> fitted_values(const simulation::Model& model) {
  const calibration::FreeParameters parameters(model);
  std::map<std::string, double> values;
  for (Eigen::Index i = 0; i < parameters.size(); ++i)
    values[parameters.names()[static_cast<std::size_t>(i)]] = parameters.value(i, parameters.start()[i]);
  return values;
}

}  // namespace

Json ladder_figures(const diagnosis::Ladder& ladder) {
  Json f;
  f["rungs"] = Json::array();
  for (const auto& rung : ladder.rungs) f["rungs"].push_back(rung_json(rung));
  f["verdict"] = diagnosis::verdict_name(ladder.verdict);
  f["missing"] = ladder.missing;
  f["last"] = {{"verdict", diagnosis::verdict_name(ladder.last.verdict)}, {"missing", ladder.last.missing}};
  f["stopped"] = ladder.stopped;
  f["noise_floor_mm"] = ladder.noise_floor_mm;
  f["parameters"] = fitted_values(ladder.model);
  return f;
}

void say_ladder(const Run& run, const diagnosis::Ladder& ladder) {
  const auto line = [&run](const std::string& name, const RungFigures& r, const std::string& left) {
    run.say(fmt::format("  {:<34}{:>8.3f}{:>8.3f}{:>10.3f}{}", name, r.mae_mm, r.rms_mm, r.held_out_rms_mm, left));
  };
  const auto left_by = [](const diagnosis::Rung& rung) {
    return fmt::format("{:>14.2f} [{:.2f}, {:.2f}]", rung.left.mean_mm, rung.left.low_mm, rung.left.high_mm);
  };
  run.say(fmt::format("  {:<34}{:>8}{:>8}{:>10}{:>14}", "ladder, mm", "MAE", "RMS", "held out", "unexplained"));
  line("refit only", ladder.rungs.front(), left_by(ladder.rungs.front()));
  for (std::size_t r = 1; r < ladder.rungs.size(); ++r) {
    const diagnosis::Rung& rung = ladder.rungs[r];
    if (rung.random_other) line("control: + " + rung.random_other->added, *rung.random_other, "");
    line("+ " + rung.added, rung, left_by(rung));
  }
  run.say(fmt::format("  noise and mesh alone would leave {:.2f}; stopped: {}", ladder.noise_floor_mm, ladder.stopped));
}

ModelText rung_model(const diagnosis::Ladder& ladder, std::size_t rung, ModelText given) {
  for (std::size_t r = 1; r <= rung; ++r) given.text = with_effect(given, ladder.rungs[r].added);
  given.text = with_values(given, fitted_values(ladder.rungs[rung].model));
  read_model(given);
  return given;
}

}  // namespace supine::pipeline
