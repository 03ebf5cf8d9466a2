// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/diagnosis_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/rms.h"
#include "diagnosis/diagnosis_file.h"
#include "diagnosis/evidence/nuisance_words.h"
#include "pipeline/results/evidence_json.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using diagnosis::Findings;
using diagnosis::Score;
using diagnosis::Verdict;
using Json = nlohmann::ordered_json;

Json registration_json(const Findings& found) {
  Json list = Json::array();
  for (const diagnosis::ScanPlace& place : found.places)
    list.push_back({{"pose", place.pose},
                    {"shift_mm", {place.shift_mm[0], place.shift_mm[1], place.shift_mm[2]}},
                    {"turn_deg", {place.turn_deg[0], place.turn_deg[1], place.turn_deg[2]}},
                    {"sd", std::vector<double>(place.sd.begin(), place.sd.end())}});
  return list;
}

Json nuisances_json(const Findings& found) {
  Json list = Json::object();
  for (const auto& nuisance : found.base.nuisances) list[nuisance.name()] = nuisance.value;
  return list;
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
  return {{"total", b.total},          {"noise", b.noise},           {"registration", b.registration},
          {"numerical", b.numerical},  {"parameters", b.parameters}, {"patchiness", b.patchiness},
          {"model_form", b.model_form}};
}

Json numerical_json(const Findings& found) {
  if (!found.base.numerical) return {{"failed", "not asked for"}};
  Json failed = Json::array();
  const diagnosis::NumericalError& error = *found.base.numerical;
  if (!error.finer_failure.empty()) failed.push_back("finer mesh: " + error.finer_failure);
  if (!error.coarser_failure.empty()) failed.push_back("coarser mesh: " + error.coarser_failure);
  return {{"correction_mm", rms(error.finer_mm)},
          {"spread_mm", error.spread_mm},
          {"length_mm", error.length_mm},
          {"failed", failed}};
}

Json forces_json(const Findings& found) {
  if (!found.forces) return nullptr;
  const diagnosis::ForceMap& map = *found.forces;
  const Eigen::VectorXd size = map.force_kpa.rowwise().norm();
  Eigen::Index place;
  const double largest = size.maxCoeff(&place);
  const auto at = found.base.fit.residuals.place.row(place);
  return {{"meaning", "a hint, no diagnosis"},
          {"largest_kpa", largest},
          {"largest_at_mm", {at[0], at[1], at[2]}},
          {"threshold_kpa", map.threshold_kpa},
          {"share_above_threshold", (size.array() > map.threshold_kpa).cast<double>().mean()},
          {"evidence_gain", map.evidence_gain},
          {"null_gain", map.null_gain}};
}

}  // namespace

diagnosis::Subject subject_of(const MeasuredCase& measured, const simulation::Model& given,
                              const std::vector<double>& noise_mm) {
  return {measured.whole_scene(), given, measured.begin_with(measured.model), noise_mm, nullptr};
}

DiagnosisResult complete(const MeasuredCase& measured, std::unique_ptr<Findings> found) {
  DiagnosisResult result{std::move(found), {}, {}};
  if (diagnosis::mesh_errs_most(result.found->budget)) result.finer_triangles = 2 * measured.mesh.faces.rows();
  const Findings& f = *result.found;
  const auto areas = calibration::anatomical_areas(measured.mesh, measured.anatomy);
  const auto measurements = measured.whole_scene().measurements;
  for (std::size_t m = 0; m < measurements.size(); ++m) {
    const calibration::ModelSkin skin(measured.mesh, f.base.fit.prediction.solution.poses[m].x);
    const auto error = diagnosis::skin_error(skin, f.base.fit.residuals, f.base.fit.prediction, m);
    const auto spots = diagnosis::find_hot_spots(skin, error, areas, measurements[m]->pose.name);
    result.hot_spots.insert(result.hot_spots.end(), spots.begin(), spots.end());
  }
  std::vector<std::string> set = f.diagnosis.missing;
  if (f.diagnosis.verdict == Verdict::nothing_missing) set.clear();
  result.next = diagnosis::next_measurements(subject_of(measured, measured.model, {}), f, set);
  return result;
}

namespace {

/// What would hide the effect at its usual size; null where straight lines say that it cannot be seen.
Json made_up_json(const diagnosis::Candidate& candidate) {
  if (!candidate.stand_in) return nullptr;
  Json list = Json::array();
  for (const diagnosis::MadeUp& number : candidate.stand_in->made_up)
    list.push_back({{"name", number.name}, {"unit", number.unit}, {"from", number.from}, {"to", number.to}});
  return list;
}

}  // namespace

Json diagnosis_figures(const DiagnosisResult& result) {
  const Findings& found = *result.found;
  Json f;
  f["verdict"] = diagnosis::verdict_name(found.diagnosis.verdict);
  f["missing"] = found.diagnosis.missing;
  f["why"] = found.diagnosis.why;
  f["ambiguous_rest"] = found.diagnosis.ambiguous_rest;
  f["under_other_priors"] = other_priors_json(found);
  f["hypotheses"] = hypotheses_json(found);
  f["included"] = included_json(found);
  f["singles"] = singles_json(found);
  f["unexplained_mm"] = found.unexplained.mean_mm;
  f["unexplained95"] = {found.unexplained.low_mm, found.unexplained.high_mm};
  f["unlisted"] = unlisted_json(found.unlisted);
  f["unexplained_bound_mm"] = found.priors.unexplained_bound_mm;
  f["registration"] = registration_json(found);
  f["candidates"] = candidates_json(found);
  f["errors_beside"] = found.errors_beside();
  f["creased_points"] = found.base.creased_points;
  f["base_mae_mm"] = found.base.fit.residuals.skin_mm().cwiseAbs().mean();
  f["base_rms_mm"] = found.rms_mm;
  f["base_held_out_rms_mm"] = found.held_out_rms_mm;
  f["base_parameters"] = Json::object();
  const calibration::FreeParameters& parameters = *found.base.parameters;
  for (Eigen::Index i = 0; i < parameters.size(); ++i)
    f["base_parameters"][parameters.names()[static_cast<std::size_t>(i)]] = parameters.value(i, found.base.fit.u[i]);
  f["nuisances_sigma"] = nuisances_json(found);
  f["unexpected"] = Json::array();
  for (const auto& far : diagnosis::far_nuisances(found.base.nuisances))
    f["unexpected"].push_back({{"name", far.name}, {"in_words", far.in_words}, {"sigma", far.sigma}});
  f["budget_mm"] = budget_json(found.budget);
  f["finer_triangles"] = result.finer_triangles > 0 ? Json(result.finer_triangles) : Json(nullptr);
  f["hot_spots"] = Json::array();
  for (const auto& spot : result.hot_spots)
    f["hot_spots"].push_back({{"area", spot.area},
                              {"pose", spot.pose},
                              {"area_cm2", spot.area_cm2},
                              {"mean_signed_mm", spot.mean_signed_mm},
                              {"centre_mm", {spot.centre_mm.x(), spot.centre_mm.y(), spot.centre_mm.z()}}});
  f["cannot_see"] = Json::array();
  const std::vector<std::string> blind = diagnosis::not_seen(found);
  for (const Score& score : found.table.scores)
    if (std::find(blind.begin(), blind.end(), score.effect) != blind.end())
      f["cannot_see"].push_back({{"effect", score.effect},
                                 {"power", score.power},
                                 {"expected_bayes_factor", std::exp(score.expected_ln_factor)},
                                 {"made_up_by", made_up_json(candidate_of(found, score.effect))}});
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
  f["noise_mm"] = found.budget.noise;
  f["numerical"] = numerical_json(found);
  return f;
}

void write_diagnosis_files(Run& run, const MeasuredCase& measured, const DiagnosisResult& result,
                           const fs::path& folder) {
  const Findings& found = *result.found;
  std::vector<std::pair<std::string, Eigen::VectorXd>> shapes;
  for (const Score& score : found.table.scores) {
    const auto& candidate = candidate_of(found, score.effect);
    Eigen::VectorXd shape = Eigen::VectorXd::Zero(found.base.fit.residuals.size());
    for (Eigen::Index k = 0; k < score.step.size(); ++k)
      shape += (score.step[k] - candidate.parameters[static_cast<std::size_t>(k)].null) * candidate.slope.col(k);
    shapes.emplace_back(score.effect, shape);
  }
  std::vector<std::string> poses;
  for (const auto* m : measured.whole_scene().measurements) poses.push_back(m->pose.name);
  diagnosis::write_diagnosis(found.base.fit.residuals, poses, shapes, found.forces ? &*found.forces : nullptr,
                             run.output(folder / "diagnosis.vtp"));
  const auto areas = calibration::anatomical_areas(measured.mesh, measured.anatomy);
  const auto measurements = measured.whole_scene().measurements;
  for (std::size_t m = 0; m < measurements.size(); ++m) {
    const calibration::ModelSkin skin(measured.mesh, found.base.fit.prediction.solution.poses[m].x);
    const auto error = diagnosis::skin_error(skin, found.base.fit.residuals, found.base.fit.prediction, m);
    const fs::path file = folder / fmt::format("error_map_{}.vtp", poses[m]);
    diagnosis::write_error_map(skin, error, areas, run.output(file));
  }
}

}  // namespace supine::pipeline
