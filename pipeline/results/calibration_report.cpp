// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/calibration_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "calibration/tissue_range.h"
#include "diagnosis/evidence/never_known.h"

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using calibration::DistanceFigures;
using calibration::FreeParameters;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json figures_json(const DistanceFigures& f) {
  return {{"mae_mm", number(f.mae_mm)},
          {"rms_mm", number(f.rms_mm)},
          {"median_mm", number(f.median_mm)},
          {"p95_mm", number(f.p95_mm)},
          {"mean_signed_mm", number(f.mean_signed_mm)}};
}

/// By source, how much of a coordinate's variance that leaves; empty where nothing but points is allowed for.
std::map<std::string, double> never_known_variances(const CalibrationResult& result, Eigen::Index i) {
  std::map<std::string, double> variances;
  for (std::size_t k = 0; k < result.never_known.size(); ++k)
    variances[result.never_known[k]] += std::pow(result.uncertainty.never_known(i, static_cast<Eigen::Index>(k)), 2);
  return variances;
}

/// Of a parameter most of whose interval is what nobody knows: how much, and what most of all.
std::optional<std::string> never_known_remark(const FreeParameters& parameters, const CalibrationResult& result,
                                              Eigen::Index i) {
  constexpr double most = 0.5;
  const auto variances = never_known_variances(result, i);
  if (variances.empty()) return {};
  double sum = 0;
  for (const auto& [source, variance] : variances) sum += variance;
  const double share = sum / result.uncertainty.covariance(i, i);
  if (!(share > most)) return {};
  const auto largest = std::max_element(variances.begin(), variances.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return fmt::format(
      "{:.0f} % of what is left open of {} is what nobody knows, most of it {}. --method joint fits that as well and "
      "leaves less open",
      100 * share, parameters.names()[static_cast<std::size_t>(i)], diagnosis::words_of_source(largest->first));
}

Json parameters_json(const FreeParameters& parameters, const CalibrationResult& result) {
  Json list = Json::array();
  const auto outside = calibration::outside_tissue(parameters, result.fit.u);
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    list.push_back({{"name", parameters.names()[k]},
                    {"value", parameters.value(i, result.fit.u[i])},
                    {"unit", parameters.unit(i)},
                    {"start", parameters.value(i, parameters.start()[i])},
                    {"interval95", {result.intervals[k].low, result.intervals[k].high}},
                    {"at_bound", parameters.at_bound(result.fit.u, i)},
                    {"outside_tissue", std::find(outside.begin(), outside.end(), i) != outside.end()}});
  }
  return list;
}

Json worth_json(const FreeParameters& parameters, const CalibrationResult& result) {
  const auto& u = result.uncertainty;
  const Eigen::VectorXd sd = u.covariance.diagonal().cwiseSqrt();
  Json correlation = Json::array(), pairs = Json::array(), singular = Json::array();
  for (Eigen::Index i = 0; i < sd.size(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < sd.size(); ++j) row.push_back(u.covariance(i, j) / (sd[i] * sd[j]));
    correlation.push_back(row);
    singular.push_back(u.singular[i]);
  }
  for (const auto& pair : u.not_told_apart)
    pairs.push_back({{"first", pair.first}, {"second", pair.second}, {"correlation", pair.correlation}});
  Json coordinates = Json::array();
  for (Eigen::Index i = 0; i < sd.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto& believed = parameters.priors()[k];
    const calibration::Prior* prior = result.used_priors && believed ? &*believed : nullptr;
    const auto& alone = result.likelihoods[k];
    Json never_known = Json::object();
    for (const auto& [source, variance] : never_known_variances(result, i)) never_known[source] = std::sqrt(variance);
    coordinates.push_back({{"name", parameters.names()[k]},
                           {"coordinate", parameters.is_log(i) ? "ln(value)" : "value, scaled"},
                           {"sd", sd[i]},
                           {"sd_if_points_erred_alone", std::sqrt(u.white(i, i))},
                           {"sd_never_known", never_known},
                           {"at", result.fit.u[i]},
                           {"prior_mean", prior ? Json(prior->mean) : Json(nullptr)},
                           {"prior_sd", prior ? Json(prior->sd) : Json(nullptr)},
                           {"likelihood", alone ? Json{{"mean", alone->mean}, {"sd", alone->sd}} : Json(nullptr)}});
  }
  return {{"rank", u.rank},
          {"coordinates", coordinates},
          {"correlation", correlation},
          {"singular_values", singular},
          {"not_told_apart", pairs}};
}

}  // namespace

std::vector<std::string> calibration_remarks(const FreeParameters& parameters, const CalibrationResult& result) {
  std::vector<std::string> remarks;
  const auto& names = parameters.names();
  for (Eigen::Index i = 0; i < parameters.size(); ++i)
    if (parameters.at_bound(result.fit.u, i))
      remarks.push_back(
          fmt::format("{} ended at an end of its range ({:.4g}{}): the data pull it further, or say nothing about it",
                      names[static_cast<std::size_t>(i)], parameters.value(i, result.fit.u[i]),
                      parameters.unit(i) == "1" ? "" : " " + parameters.unit(i)));
  for (const Eigen::Index i :
       result.object ? std::vector<Eigen::Index>{} : calibration::outside_tissue(parameters, result.fit.u)) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    const calibration::TissueRange range = calibration::tissue_range(name).value();
    remarks.push_back(fmt::format(
        "{} = {:.3g} kPa is no modulus that tissue has ({:g} to {:g} kPa): it makes up for something else. Look "
        "whether "
        "the scan lies where it should (--scan-offset, supine-register), and at what the model lacks (supine-diagnose)",
        name, parameters.value(i, result.fit.u[i]), range.softest_kpa, range.stiffest_kpa));
  }
  for (Eigen::Index i = 0; i < parameters.size(); ++i)
    if (const auto remark = never_known_remark(parameters, result, i)) remarks.push_back(*remark);
  for (const auto& pair : result.uncertainty.not_told_apart)
    remarks.push_back(fmt::format("{} and {} cannot be told apart here (correlation {:.3f}): {}", pair.first,
                                  pair.second, pair.correlation,
                                  pair.correlation < 0 ? "one falls as the other rises, and the error hardly changes"
                                                       : "they rise and fall together"));
  if (result.uncertainty.rank < parameters.size())
    remarks.push_back(fmt::format("the measurement determines {} of {} directions of the parameters",
                                  result.uncertainty.rank, parameters.size()));
  const auto is_free = [&names](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const simulation::Model model = parameters.model(result.fit.u);
  const double modulus = model.skin.young_modulus_kpa.value, thickness = model.skin.thickness_mm.value;
  if (modulus > 0 && model.skin.bending_share == 0)
    remarks.push_back(fmt::format(
        "the skin enters as modulus × thickness only: {:.4g} kPa × {:.4g} mm = {:.4g} kPa mm{}", modulus, thickness,
        modulus * thickness,
        is_free("skin.young_modulus_kpa") && is_free("skin.thickness_mm") ? "; both are free, which no data can settle"
                                                                          : ""));
  remarks.push_back(fmt::format(
      "stiffness enters as stiffness / density only: with another density than {:.4g} kg/m3 every modulus and spring "
      "changes in proportion",
      model.breast.density_kg_m3.value));
  return remarks;
}

Json calibration_figures(const MeasuredCase& measured, const FreeParameters& parameters,
                         const CalibrationResult& result) {
  const calibration::Fit& fit = result.fit;
  Json f;
  f["method"] = result.method;
  f["mae_study_mm"] = number(fit.prediction.mae_study_mm());
  f["mae_mm"] = result.in_sample.mae_mm;
  f["rms_mm"] = result.in_sample.rms_mm;
  if (result.as_given) f["as_given"] = figures_json(*result.as_given);
  f["held_out_rms_mm"] = result.held_out_blocks.rms_mm;
  f["held_out"] = {{"blocks", 6}, {"by_block", figures_json(result.held_out_blocks)}, {"by_pose", Json::array()}};
  for (const auto& pose : result.held_out_poses) {
    Json row = {{"pose", pose.pose}, {"mae_study_mm", number(pose.mae_study_mm)}};
    row.update(figures_json(pose.figures));
    f["held_out"]["by_pose"].push_back(row);
  }
  f["parameters"] = parameters_json(parameters, result);
  f["interval_kind"] = result.interval_kind;
  f["evaluations"] = fit.evaluations;
  f["iterations"] = fit.iterations;
  f["failed_solves"] = fit.failed;
  f["converged"] = fit.converged;
  f["message"] = fit.message;
  f["start_costs"] = Json::array();
  for (const double cost : fit.start_costs) f["start_costs"].push_back(number(cost));
  f["scan_points_used"] = fit.residuals.skin_rows();
  if (result.method == "joint") f["landmarks_used"] = fit.residuals.landmark_rows / 3;
  f["poses"] = Json::array();
  for (std::size_t m = 0; m < measured.fitted.size(); ++m)
    f["poses"].push_back({{"pose", measured.fitted[m].pose.name},
                          {"noise_mm", result.noise_mm[m]},
                          {"noise_is", measured.fitted[m].noise_mm ? "given" : "estimated"},
                          {"points_left_out", measured.fitted[m].left_out.size()}});
  const auto& errors = result.uncertainty.errors;
  f["error_model"] = {{"nugget_mm", errors.nugget_mm},
                      {"shared_mm", errors.spread_mm},
                      {"length_mm", errors.length_mm},
                      {"effective_points", result.uncertainty.effective_points}};
  f["worth"] = worth_json(parameters, result);
  if (!result.nuisances.empty()) f["nuisances"] = Json::array();
  for (const auto& n : result.nuisances) f["nuisances"].push_back({{"name", n.name}, {"value", n.value}, {"sd", n.sd}});
  f["remarks"] = calibration_remarks(parameters, result);
  int profile_runs = 0;
  for (const auto& [name, profile] : result.profiles) profile_runs += profile.runs;
  f["profile_evaluations"] = profile_runs;
  return f;
}

void say_calibration(const Run& run, const FreeParameters& parameters, const CalibrationResult& result) {
  run.say(fmt::format("  {:<36}{:>10}{:>10}   {}", "parameter", "start", "fitted", "95 % interval"));
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    run.say(fmt::format("  {:<36}{:>10.4g}{:>10.4g}   {:.4g} to {:.4g} {}", parameters.names()[k],
                        parameters.value(i, parameters.start()[i]), parameters.value(i, result.fit.u[i]),
                        result.intervals[k].low, result.intervals[k].high,
                        parameters.unit(i) == "1" ? "" : parameters.unit(i)));
  }
  const auto row = [&run](const std::string& what, const DistanceFigures& f) {
    run.say(fmt::format("  {:<36}{:>10.3f}{:>10.3f}", what, f.mae_mm, f.rms_mm));
  };
  run.say(fmt::format("  {:<36}{:>10}{:>10}", "error, mm", "MAE", "RMS"));
  row("fitted points", result.in_sample);
  if (result.as_given) row("the same, scans and gravity as given", *result.as_given);
  row("held out, 6 blocks of skin", result.held_out_blocks);
  for (const auto& pose : result.held_out_poses) row("held out, pose " + pose.pose, pose.figures);
  const double study = result.fit.prediction.mae_study_mm();  // a contour covers no area
  run.say(fmt::format("  {:<36}{:>10}", "MAE model to scan (study)",
                      std::isnan(study) ? "-" : fmt::format("{:.3f}", study)));
  run.say(fmt::format("  {} chain runs, {} of them without equilibrium; {} steps{}", result.fit.evaluations,
                      result.fit.failed, result.fit.iterations, result.fit.converged ? "" : "; NOT converged"));
  for (const std::string& remark : calibration_remarks(parameters, result)) run.say("  - " + remark);
}

}  // namespace supine::pipeline
