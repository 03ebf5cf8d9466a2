// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/diagnosis_report.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "diagnosis/diagnosis_file.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using diagnosis::Findings;
using diagnosis::Refit;
using diagnosis::Score;
using diagnosis::Verdict;
using Json = nlohmann::ordered_json;

const diagnosis::Candidate& candidate_of(const Findings& found, const std::string& effect) {
  return *std::find_if(found.candidates.begin(), found.candidates.end(),
                       [&effect](const diagnosis::Candidate& c) { return c.effect == effect; });
}

const Refit* refit_of(const Findings& found, const std::string& effect) {
  for (const Refit& refit : found.refits)
    if (refit.effect == effect && refit.solved) return &refit;
  return nullptr;
}

std::vector<std::string> rivals_of(const Findings& found, const std::string& effect) {
  std::vector<std::string> names;
  const auto& set = found.diagnosis.missing;
  if (std::find(set.begin(), set.end(), effect) == set.end()) return names;
  for (const std::string& other : set)
    if (other != effect) names.push_back(other);
  return names;
}

/// Of the refit where there is one, else of the linear step.
Json parameters_json(const diagnosis::Candidate& candidate, const Score& score, const Refit* refit) {
  Json list = Json::array();
  if (refit != nullptr) {
    for (const auto& p : refit->parameters)
      list.push_back({{"name", p.name}, {"value", p.value}, {"unit", p.unit}, {"interval95", {p.low, p.high}}});
    return list;
  }
  for (Eigen::Index k = 0; k < score.step.size(); ++k) {
    const auto& p = candidate.parameters[static_cast<std::size_t>(k)];
    const double reach = normal_reach95() * score.step_sd[k];
    list.push_back({{"name", p.name},
                    {"value", score.step[k]},
                    {"unit", p.unit},
                    {"interval95", {score.step[k] - reach, score.step[k] + reach}}});
  }
  return list;
}

Json number_or_null(const std::vector<double>& values) { return values.empty() ? Json(nullptr) : Json(values); }

Json left_json(const diagnosis::LackOfFit& left) { return {{"misfit", left.misfit}, {"p_value", left.p_value}}; }

Json candidate_json(const Findings& found, const Score& score) {
  const Refit* refit = refit_of(found, score.effect);
  const bool judged = refit && unfitted_scans_judge(*refit, found.others.unfitted);
  return {
      {"effect", score.effect},
      {"p_value", score.p_value},
      {"predicted_rms_mm", score.predicted_rms_mm},
      {"refit_rms_mm", refit ? Json(refit->rms_mm) : Json(nullptr)},
      {"held_out_rms_mm", refit ? refit->held_out_rms_mm : score.predicted_held_out_rms_mm},
      {"held_out_pose_rms_mm", refit ? number_or_null(refit->pose_rms_mm) : Json(nullptr)},
      {"changes_pose_mm", refit ? number_or_null(refit->pose_change_mm) : Json(nullptr)},
      {"pose_gain", judged ? Json(refit->pose_gain) : Json(nullptr)},
      {"pose_misfit", judged ? Json(refit->pose_misfit) : Json(nullptr)},
      {"left", refit ? left_json(found.left[static_cast<std::size_t>(refit - found.refits.data())]) : Json(nullptr)},
      {"parameters", parameters_json(candidate_of(found, score.effect), score, refit)},
      {"not_told_apart_from", rivals_of(found, score.effect)},
      {"same_shape_as", score.not_told_apart_from},
      {"statistic", score.statistic},
      {"freedom", score.freedom},
      {"bic", score.bic},
      {"refit_bic", refit ? Json(refit->bic) : Json(nullptr)},
      {"refit_finished", refit ? Json(refit->finished) : Json(nullptr)},
      {"at_border", refit ? Json(refit->at_border) : Json(nullptr)},
      {"wrong_sign", score.wrong_sign},
      {"beyond_range", score.beyond_range},
      {"predicted_held_out_rms_mm", score.predicted_held_out_rms_mm},
      {"noncentrality", score.noncentrality},
      {"power", score.power}};
}

Json alike_json(const diagnosis::ScoreTable& table) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < table.alike.rows(); ++i) {
    const Eigen::VectorXd row = table.alike.row(i);
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return {{"effects", table.effects}, {"correlation", rows}};
}

Json budget_json(const diagnosis::ErrorBudget& b) {
  return {{"total", b.total},         {"noise", b.noise},           {"registration", b.registration},
          {"numerical", b.numerical}, {"parameters", b.parameters}, {"model_form", b.model_form}};
}

Json numerical_json(const Findings& found) {
  if (!found.numerical) return {{"failed", found.numerical_failure}};
  Json failed = Json::array();
  const diagnosis::NumericalError& error = *found.numerical;
  if (!error.finer_failure.empty()) failed.push_back("finer mesh: " + error.finer_failure);
  if (!error.coarser_failure.empty()) failed.push_back("coarser mesh: " + error.coarser_failure);
  return {{"spread_mm", found.sources.spread_mm}, {"length_mm", found.sources.length_mm}, {"failed", failed}};
}

Json forces_json(const Findings& found) {
  if (!found.forces) return nullptr;
  const diagnosis::ForceMap& map = *found.forces;
  const Eigen::VectorXd size = map.force_kpa.rowwise().norm();
  Eigen::Index place;
  const double largest = size.maxCoeff(&place);
  const auto at = found.base.solution.residuals.place.row(place);
  return {{"meaning", "a hint, no diagnosis"},
          {"largest_kpa", largest},
          {"largest_at_mm", {at[0], at[1], at[2]}},
          {"threshold_kpa", map.threshold_kpa},
          {"share_above_threshold", (size.array() > map.threshold_kpa).cast<double>().mean()},
          {"evidence_gain", map.evidence_gain},
          {"null_gain", map.null_gain}};
}

std::string values_of(const std::vector<diagnosis::FittedParameter>& parameters) {
  std::string text;
  for (const auto& p : parameters) {
    const std::string unit = p.unit == "1" ? "" : " " + p.unit;
    text += fmt::format("{}{} {:.2g} [{:.2g}, {:.2g}]{}", text.empty() ? "" : ", ", p.name.substr(p.name.find('.') + 1),
                        p.value, p.low, p.high, unit);
  }
  return text;
}

void say_scores(const Run& run, const Findings& found) {
  run.say(fmt::format("  {:<20}{:>9}{:>4}{:>9}{:>8}{:>7}   {}", "if it had", "T", "q", "BIC", "p", "power",
                      "one-step size"));
  for (const Score& score : found.table.scores) {
    const auto& candidate = candidate_of(found, score.effect);
    std::string sizes;
    for (Eigen::Index k = 0; k < score.step.size(); ++k) {
      const auto& p = candidate.parameters[static_cast<std::size_t>(k)];
      sizes += fmt::format("{}{:.3g}{}", k > 0 ? ", " : "", score.step[k], p.unit == "1" ? "" : " " + p.unit);
    }
    run.say(fmt::format("  {:<20}{:>9.1f}{:>4}{:>9.1f}{:>8.3f}{:>7.2f}   {}{}{}", score.effect, score.statistic,
                        score.freedom, score.bic, score.p_value, score.power, sizes,
                        score.wrong_sign ? " (wrong sign)" : "", score.beyond_range ? " (implausible size)" : ""));
  }
}

void say_refits(const Run& run, const Findings& found) {
  if (found.refits.empty()) return;
  run.say(fmt::format("  {:<20}{:>9}{:>8}{:>10}{:>10}{:>8}{:>8}   {}", "added, fitted again", "BIC", "RMS", "held out",
                      "pose", "gain", "misfit", "values"));
  for (std::size_t r = 0; r < found.refits.size(); ++r) {
    const Refit& refit = found.refits[r];
    if (!refit.solved)
      run.say(fmt::format("  {:<20}  no equilibrium", refit.effect));
    else
      run.say(fmt::format(
          "  {:<20}{:>9.1f}{:>8.3f}{:>10.3f}{:>10}{:>8}{:>8.2f}   {}{}", refit.effect, refit.bic, refit.rms_mm,
          refit.held_out_rms_mm, refit.pose_rms_mm.empty() ? "-" : fmt::format("{:.3f}", refit.pose_rms_mm[0]),
          unfitted_scans_judge(refit, found.others.unfitted) ? fmt::format("{:.1f}", refit.pose_gain) : "-",
          found.left[r].misfit, values_of(refit.parameters),
          !refit.finished   ? " (given up early)"
          : refit.at_border ? " (place or width at the border of its range)"
                            : ""));
  }
}

std::string where(const std::vector<diagnosis::HotSpot>& spots) {
  constexpr std::size_t most = 4;
  std::string text;
  for (std::size_t s = 0; s < std::min(most, spots.size()); ++s)
    text += fmt::format("{}{} {:+.1f} mm ({:.0f} cm²)", s > 0 ? ", " : "", spots[s].area, spots[s].mean_signed_mm,
                        spots[s].area_cm2);
  return text.empty() ? "nowhere by more than noise" : text;
}

/// ", unfitted pose 1.17 -> 0.92 mm"; empty where there is none.
std::string pose_fall(const Findings& found, const Refit& refit) {
  const auto& before = found.figures.pose_rms_mm;
  if (before.empty() || before.size() != refit.pose_rms_mm.size()) return {};
  const bool none_fitted = found.figures.unfitted_poses == before.size();
  std::string text = fmt::format(", {} pose{}", none_fitted ? "unfitted" : "left-out", before.size() == 1 ? "" : "s");
  for (std::size_t i = 0; i < before.size(); ++i)
    text += fmt::format("{} {:.2f} -> {:.2f}", i > 0 ? "," : "", before[i], refit.pose_rms_mm[i]);
  return text + " mm";
}

/// The lowest of what is named.
double p_of_named(const Findings& found) {
  double p = 1;
  for (const Score& score : found.table.scores)
    for (const std::string& name : found.diagnosis.missing)
      if (score.effect == name) p = std::min(p, score.p_value);
  return p;
}

void say_verdict(const Run& run, const Findings& found) {
  const diagnosis::Diagnosis& d = found.diagnosis;
  const std::string names = fmt::format("{}", fmt::join(d.missing, " or "));
  const double p = p_of_named(found);
  const Refit* best = d.missing.empty() ? nullptr : refit_of(found, d.missing[0]);
  switch (d.verdict) {
    case Verdict::nothing_missing:
      run.say(fmt::format("  nothing missing: {}", d.why));
      break;
    case Verdict::missing:
      run.say(fmt::format("  missing:  {}   held-out {:.2f} -> {:.2f} mm{}   p {:.3f}   {}", names,
                          found.figures.held_out_rms_mm, best->held_out_rms_mm, pose_fall(found, *best), p,
                          values_of(best->parameters)));
      break;
    case Verdict::ambiguous:
      run.say(fmt::format("  missing, cannot be told apart: {}   p {:.3f}", names, p));
      break;
    case Verdict::unexplained:
      run.say(fmt::format("  unexplained: {}{}", d.why, names.empty() ? "" : "; best: " + names));
      if (found.forces)
        run.say(
            fmt::format("  hint:     forces on the skin that would explain it reach {:.2f} kPa, {:.2f} by chance; "
                        "missing_force_kpa in diagnosis.vtp",
                        found.forces->force_kpa.rowwise().norm().maxCoeff(), found.forces->threshold_kpa));
  }
}

void say_limits(const Run& run, const DiagnosisResult& result) {
  const Findings& found = *result.found;
  std::vector<std::string> blind = diagnosis::not_seen(found);
  blind.insert(blind.end(), found.unseen.begin(), found.unseen.end());
  const auto& set = found.diagnosis.missing;
  if (found.diagnosis.verdict == Verdict::missing) run.say("  not told apart from it: none");
  run.say(fmt::format("  could not be seen with this scan: {}",
                      blind.empty() ? "none" : fmt::format("{}", fmt::join(blind, ", "))));
  if (!result.next.empty()) {
    const auto& best = result.next.front();
    std::string text = "  next measurement: " + best.measurement;
    if (set.size() > 1 && best.separation > 0)
      text += fmt::format(" would separate {} by {:.0f} (9 is enough)", best.closest_pair, best.separation);
    if (!best.shows.empty()) text += fmt::format("; shows {} best of what cannot be seen now", best.shows);
    run.say(text);
  }
  if (found.diagnosis.verdict == Verdict::missing)
    run.say(fmt::format("  add it:   supine-model add {} model.toml && make CASE=... calibrate", set[0]));
}

}  // namespace

diagnosis::Subject subject_of(const MeasuredCase& measured, const simulation::Model& model,
                              const std::vector<double>& noise_mm) {
  return {measured.fitted_scene(), measured.whole_scene(), model, noise_mm, nullptr};
}

DiagnosisResult complete(const MeasuredCase& measured, std::unique_ptr<Findings> found) {
  DiagnosisResult result{std::move(found), {}, {}};
  const Findings& f = *result.found;
  const auto areas = calibration::anatomical_areas(measured.mesh, measured.anatomy);
  for (std::size_t m = 0; m < measured.fitted.size(); ++m) {
    const calibration::ModelSkin skin(measured.mesh, f.base.solution.prediction.solution.poses[m].x);
    const auto error = diagnosis::skin_error(skin, f.base.solution.residuals, f.base.solution.prediction, m);
    const auto spots = diagnosis::find_hot_spots(skin, error, areas, measured.fitted[m].pose.name);
    result.hot_spots.insert(result.hot_spots.end(), spots.begin(), spots.end());
  }
  std::vector<std::string> set = f.diagnosis.missing;
  if (f.diagnosis.verdict == Verdict::nothing_missing) set.clear();
  result.next = diagnosis::next_measurements(subject_of(measured, f.model, {}), f, set);
  return result;
}

Json diagnosis_figures(const DiagnosisResult& result) {
  const Findings& found = *result.found;
  Json f;
  f["verdict"] = diagnosis::verdict_name(found.diagnosis.verdict);
  f["missing"] = found.diagnosis.missing;
  f["why"] = found.diagnosis.why;
  f["candidates"] = Json::array();
  for (const Refit& refit : found.refits)  // refitted ones first, best first
    for (const Score& score : found.table.scores)
      if (score.effect == refit.effect) f["candidates"].push_back(candidate_json(found, score));
  for (const Score& score : found.table.scores)
    if (std::none_of(found.refits.begin(), found.refits.end(),
                     [&score](const Refit& r) { return r.effect == score.effect; }))
      f["candidates"].push_back(candidate_json(found, score));
  f["base_mae_mm"] = found.base.solution.residuals.distance_mm.cwiseAbs().mean();
  f["base_rms_mm"] = found.figures.rms_mm;
  f["base_held_out_rms_mm"] = found.figures.held_out_rms_mm;
  f["base_held_out_pose_rms_mm"] = number_or_null(found.figures.pose_rms_mm);
  f["base_pose_misfit"] =
      found.others.unfitted > 0 && !found.sources.unfitted_mean_mm.empty() ? Json(found.others.misfit) : Json(nullptr);
  f["other_poses_corrected"] = !found.sources.unfitted_mean_mm.empty();
  f["base_parameters"] = Json::object();
  const calibration::FreeParameters parameters(found.model);
  for (Eigen::Index i = 0; i < parameters.size(); ++i)
    f["base_parameters"][parameters.names()[static_cast<std::size_t>(i)]] =
        parameters.value(i, found.base.solution.u[i]);
  f["left_before"] = left_json(found.figures.left);
  f["left_after"] = left_json(found.diagnosis.left);
  f["budget_mm"] = budget_json(found.budget);
  f["hot_spots"] = Json::array();
  for (const auto& spot : result.hot_spots)
    f["hot_spots"].push_back({{"area", spot.area},
                              {"pose", spot.pose},
                              {"area_cm2", spot.area_cm2},
                              {"mean_signed_mm", spot.mean_signed_mm},
                              {"centre_mm", {spot.centre_mm.x(), spot.centre_mm.y(), spot.centre_mm.z()}}});
  f["cannot_see"] = Json::array();
  for (const Score& score : found.table.scores)
    if (score.power < 0.5) f["cannot_see"].push_back({{"effect", score.effect}, {"power", score.power}});
  for (const std::string& effect : found.unseen) f["cannot_see"].push_back({{"effect", effect}, {"power", 0.05}});
  f["next_measurement"] = Json::array();
  for (const auto& next : result.next)
    f["next_measurement"].push_back({{"measurement", next.measurement},
                                     {"separation", next.separation},
                                     {"closest_pair", next.closest_pair},
                                     {"mean_power_of_unseen", next.single_power},
                                     {"shows", next.shows}});
  f["alike"] = alike_json(found.table);
  f["missing_force"] = forces_json(found);
  f["effective_points"] = found.table.effective_points;
  f["noise_mm"] = found.figures.noise_mm;
  f["numerical"] = numerical_json(found);
  return f;
}

void say_diagnosis(const Run& run, const DiagnosisResult& result) {
  const Findings& found = *result.found;
  const auto& b = found.budget;
  say_scores(run, found);
  say_refits(run, found);
  run.say(
      fmt::format("  residual: MAE {:.2f} mm, RMS {:.2f}, held-out {:.2f}; scan noise {:.2f}, registration {:.2f}, "
                  "numerical {:.2f}, parameters {:.2f}, model {:.2f}",
                  found.base.solution.residuals.distance_mm.cwiseAbs().mean(), b.total, found.figures.held_out_rms_mm,
                  b.noise, b.registration, b.numerical, b.parameters, b.model_form));
  run.say("  where:    " + where(result.hot_spots));
  say_verdict(run, found);
  say_limits(run, result);
}

void write_diagnosis_files(Run& run, const MeasuredCase& measured, const DiagnosisResult& result,
                           const fs::path& folder) {
  const Findings& found = *result.found;
  std::vector<std::pair<std::string, Eigen::VectorXd>> shapes;
  for (const Score& score : found.table.scores) {
    const auto& candidate = candidate_of(found, score.effect);
    Eigen::VectorXd shape = Eigen::VectorXd::Zero(found.base.solution.residuals.size());
    for (Eigen::Index k = 0; k < score.step.size(); ++k)
      shape += (score.step[k] - candidate.parameters[static_cast<std::size_t>(k)].null) * candidate.slope.col(k);
    shapes.emplace_back(score.effect, shape);
  }
  std::vector<std::string> poses;
  for (const auto& m : measured.fitted) poses.push_back(m.pose.name);
  diagnosis::write_diagnosis(found.base.solution.residuals, poses, shapes, found.forces ? &*found.forces : nullptr,
                             run.output(folder / "diagnosis.vtp"));
  const auto areas = calibration::anatomical_areas(measured.mesh, measured.anatomy);
  for (std::size_t m = 0; m < measured.fitted.size(); ++m) {
    const calibration::ModelSkin skin(measured.mesh, found.base.solution.prediction.solution.poses[m].x);
    const auto error = diagnosis::skin_error(skin, found.base.solution.residuals, found.base.solution.prediction, m);
    const fs::path file = folder / fmt::format("error_map_{}.vtp", poses[m]);
    diagnosis::write_error_map(skin, error, areas, run.output(file));
  }
}

}  // namespace supine::pipeline
