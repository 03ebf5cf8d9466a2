// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/diagnosis_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/rms.h"
#include "common/statistics.h"
#include "diagnosis/diagnosis_file.h"
#include "diagnosis/evidence/nuisance_words.h"
#include "diagnosis/over_sets.h"
#include "diagnosis/size_named.h"
#include "simulation/parameters.h"

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

/// Of the most probable set that was refitted and holds the effect.
const Refit* refit_of(const Findings& found, const std::string& effect) {
  for (const Refit& refit : found.refits)
    if (refit.solved && std::find(refit.effects.begin(), refit.effects.end(), effect) != refit.effects.end())
      return &refit;
  return nullptr;
}

std::vector<std::string> rivals_of(const Findings& found, const std::string& effect) {
  std::vector<std::string> names;
  if (found.diagnosis.verdict != Verdict::ambiguous) return names;
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
      if (p.name.starts_with(candidate.effect + "."))
        list.push_back({{"name", p.name},
                        {"value", p.value},
                        {"unit", p.unit},
                        {"interval95", {p.low, p.high}},
                        {"at_bound", p.end != diagnosis::RangeEnd::none}});
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

Json finite_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json candidate_json(const Findings& found, const Score& score) {
  const Refit* refit = refit_of(found, score.effect);
  return {{"effect", score.effect},
          {"probability", found.included_of(score.effect).probability},
          {"p_value", score.p_value},
          {"predicted_rms_mm", score.predicted_rms_mm},
          {"refit_rms_mm", refit ? Json(refit->rms_mm) : Json(nullptr)},
          {"held_out_rms_mm", refit ? refit->held_out_rms_mm : score.predicted_held_out_rms_mm},
          {"parameters", parameters_json(candidate_of(found, score.effect), score, refit)},
          {"not_told_apart_from", rivals_of(found, score.effect)},
          {"same_shape_as", score.not_told_apart_from},
          {"statistic", score.statistic},
          {"freedom", score.freedom},
          {"at_border", refit ? Json(refit->at_border) : Json(nullptr)},
          {"wrong_sign", score.wrong_sign},
          {"beyond_range", score.beyond_range},
          {"predicted_held_out_rms_mm", score.predicted_held_out_rms_mm},
          {"noncentrality", score.noncentrality},
          {"power", score.power},
          {"named_half_at", finite_json(diagnosis::size_named(found, score, 0.5))},
          {"named_mostly_at", finite_json(diagnosis::size_named(found, score, 0.9))}};
}

Json names_of(const Findings& found, const diagnosis::Hypothesis& h) {
  Json names = Json::array();
  for (const int effect : h.effects) names.push_back(found.candidates[static_cast<std::size_t>(effect)].effect);
  return names;
}

Json hypotheses_json(const Findings& found) {
  Json list = Json::array();
  for (const auto& [one, left] : found.told())
    list.push_back({{"effects", names_of(found, *one)},
                    {"probability", one->probability},
                    {"refitted", one->refitted || one->effects.empty()},
                    {"unexplained_mm", left.mean_mm},
                    {"unexplained95", {left.low_mm, left.high_mm}}});
  return list;
}

/// A local cause that no effect lists: how likely, of which kind, and where.
Json unlisted_json(const diagnosis::Unlisted& found) {
  Json kinds = Json::object();
  for (std::size_t kind = 0; kind < diagnosis::local_kinds; ++kind)
    kinds[diagnosis::local_kind_name(static_cast<diagnosis::LocalKind>(kind))] = found.by_kind[kind];
  const bool moved = found.kind == diagnosis::LocalKind::muscle;
  const auto value = [moved](double size) { return moved ? size : std::exp(size); };
  Json effect;
  if (found.effect) {
    effect["name"] = found.effect->name;
    for (const auto& [name, number] : found.effect->parameters) effect[name] = number.value;
    for (const auto& [name, option] : found.effect->options) effect[name] = option;
  }
  return {{"probability", found.probability},
          {"effect", effect},
          {"by_kind", kinds},
          {"likeliest", diagnosis::local_kind_name(found.kind)},
          {"place_mm", {found.place_mm.x(), found.place_mm.y(), found.place_mm.z()}},
          {"within_mm", found.within_mm},
          {moved ? "moved_mm" : "times_as_stiff", value(found.size)},
          {"interval95", {value(found.low), value(found.high)}}};
}

/// 1 sigma of a number where the effect is not missing: that of the nuisance which the effect replaces, else 0.
double null_sd(const Findings& found, const std::string& number) {
  for (const diagnosis::Nuisance& nuisance : found.base.nuisances)
    if (nuisance.name() == "/" + number) return nuisance.sigma;
  return 0;
}

/// Every effect by itself, as the evidence of many patients is put together from (cohort/population.h): posterior and
/// prior of its numbers, as offsets from the null, and how far the usual size of one moves the fitted points.
Json singles_json(const Findings& found) {
  const auto nothing = std::find_if(found.hypotheses.begin(), found.hypotheses.end(),
                                    [](const diagnosis::Hypothesis& h) { return h.effects.empty(); });
  Json list = Json::array();
  for (const diagnosis::Hypothesis& h : found.hypotheses) {
    if (h.effects.size() != 1) continue;
    const diagnosis::Candidate& candidate = found.candidates[static_cast<std::size_t>(h.effects.front())];
    const Refit* refit = found.refit_of({candidate.effect});
    Json numbers = Json::array();
    for (std::size_t k = 0; k < candidate.parameters.size(); ++k) {
      const diagnosis::CandidateParameter& p = candidate.parameters[k];
      const auto prior = diagnosis::strength_prior(*simulation::find_parameter(p.name));
      std::pair<double, double> known;
      const int place = h.place_of(p.name);
      if (refit != nullptr && refit->solved) {
        const auto fitted = std::find_if(refit->parameters.begin(), refit->parameters.end(),
                                         [&p](const diagnosis::FittedParameter& f) { return f.name == p.name; });
        if (fitted == refit->parameters.end()) continue;
        known = {fitted->value - p.null, (fitted->high - fitted->low) / (2 * normal_reach95())};
      } else if (place >= 0) {
        known = h.weighed.number(place);
      } else {
        continue;
      }
      const Eigen::VectorXd usual =
          candidate.secant.size() > 0
              ? candidate.secant
              : Eigen::VectorXd(candidate.slope.col(static_cast<Eigen::Index>(k)) * (p.typical - p.null));
      numbers.push_back(
          {{"name", p.name},
           {"mean", known.first},
           {"sd", known.second > 0 ? Json(known.second) : Json(nullptr)},  // none: cut at one end of the range
           {"prior_mean", prior.mean() - p.null},
           {"prior_sd", prior.sd()},
           {"null_sd", null_sd(found, p.name)},
           {"usual", p.typical - p.null},
           {"usual_moves_mm", rms(usual)}});
    }
    list.push_back({{"effect", candidate.effect},
                    {"ln_bayes_factor", h.ln_evidence - nothing->ln_evidence},
                    {"numbers", numbers}});
  }
  return list;
}

Json included_json(const Findings& found) {
  Json list = Json::array();
  for (const diagnosis::Inclusion& one : found.included) {
    Json numbers = Json::array();
    for (const diagnosis::FittedParameter& p : diagnosis::over_sets(found, one.effect))
      numbers.push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"interval95", {p.low, p.high}}});
    list.push_back({{"effect", one.effect},
                    {"probability", one.probability},
                    {"bayes_factor", one.bayes_factor},
                    {"left_out_gain", one.left_out_gain},
                    {"ends_at", one.ends_at},
                    {"numbers", numbers}});
  }
  return list;
}

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
  f["under_other_priors"] = Json::array();
  for (const diagnosis::OtherPrior& other : found.under_other_priors) {
    Json one = {{"what", other.what},
                {"verdict", diagnosis::verdict_name(other.diagnosis.verdict)},
                {"missing", other.diagnosis.missing},
                {"included", Json::object()}};
    for (const diagnosis::Inclusion& i : other.included) one["included"][i.effect] = i.probability;
    f["under_other_priors"].push_back(std::move(one));
  }
  f["hypotheses"] = hypotheses_json(found);
  f["included"] = included_json(found);
  f["singles"] = singles_json(found);
  f["unexplained_mm"] = found.unexplained.mean_mm;
  f["unexplained95"] = {found.unexplained.low_mm, found.unexplained.high_mm};
  f["unlisted"] = unlisted_json(found.unlisted);
  f["unexplained_bound_mm"] = found.priors.unexplained_bound_mm;
  f["registration"] = registration_json(found);
  f["candidates"] = Json::array();
  for (const diagnosis::Inclusion& one : found.included)  // most probable first
    for (const Score& score : found.table.scores)
      if (score.effect == one.effect) f["candidates"].push_back(candidate_json(found, score));
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
