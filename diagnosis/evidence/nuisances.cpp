// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/nuisances.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using simulation::Effect;
using simulation::EffectSetting;
using simulation::Model;

constexpr const char* springs[] = {"interface.normal_kpa_per_mm", "cut.stiffness_kpa_per_mm"};

bool has(const Model& model, const std::string& effect) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [&effect](const EffectSetting& setting) { return setting.name == effect; });
}

void add_of_effect(const Effect& effect, const std::vector<std::string>& poses, const Priors& priors,
                   std::vector<Nuisance>& list) {
  const simulation::EffectTraits traits = effect.traits();
  for (const simulation::Parameter& row : effect.parameters()) {
    if (row.shape) continue;
    const auto add = [&](const std::string& pose, const simulation::MeasurementTolerances& known) {
      if (const double sigma = effect.tolerance(row.unit, known); sigma > 0)
        list.push_back({traits.error_source, pose, effect.name(), row.name, sigma, {}});
    };
    if (!traits.error_of_each_scan) add({}, priors.known);
    for (const std::string& pose : poses)
      if (traits.error_of_each_scan && pose != poses.front()) add(pose, priors.known_in(pose));
  }
}

EffectSetting& setting_of(std::vector<EffectSetting>& settings, const std::string& effect) {
  for (EffectSetting& setting : settings)
    if (setting.name == effect) return setting;
  settings.push_back(simulation::null_setting(*simulation::find_effect(effect)));
  return settings.back();
}

}  // namespace

std::vector<std::string> poses_of(const calibration::MeasuredScene& scene) {
  std::vector<std::string> poses{scene.prone.name};
  for (const auto* measurement : scene.measurements) poses.push_back(measurement->pose.name);
  return poses;
}

std::vector<Nuisance> nuisances_of(const Model& model, const std::vector<std::string>& poses, const Priors& priors) {
  std::vector<Nuisance> list;
  for (const Effect* effect : simulation::catalogue()) {
    const simulation::EffectTraits traits = effect->traits();
    if (traits.error_source.empty() || (has(model, effect->name()) && !traits.error_of_each_scan)) continue;
    add_of_effect(*effect, poses, priors, list);
  }
  for (const std::string name : springs)
    if (const simulation::Setting& setting = simulation::base_setting(model, name); !setting.free && setting.value > 0)
      list.push_back({"springs", {}, {}, name, priors.known.spring_log, {}});
  return list;
}

Model with_nuisances(Model model, const std::vector<Nuisance>& nuisances, const std::vector<std::string>& poses) {
  for (const Nuisance& nuisance : nuisances) {
    if (nuisance.value == 0) continue;
    const double change = nuisance.value * nuisance.sigma;
    if (nuisance.effect.empty()) simulation::base_setting(model, nuisance.parameter).value *= std::exp(change);
    for (const std::string& pose : poses)
      if (!nuisance.effect.empty() && (nuisance.pose.empty() || nuisance.pose == pose))
        setting_of(model.of_pose[pose], nuisance.effect).parameters[nuisance.parameter].value += change;
  }
  return model;
}

void move_along(const Nuisance& nuisance, double step, simulation::ChainSolution& solution) {
  if (!nuisance.motion || step == 0) return;
  const double change = step * nuisance.motion_per_sigma;
  if (nuisance.pose.empty()) return calibration::move_along(*nuisance.motion, change, solution);
  for (std::size_t p = 0; p < solution.poses.size(); ++p)
    if (solution.poses[p].name == nuisance.pose) solution.poses[p].x += change * nuisance.motion->poses[p];
}

void find_shapes(calibration::Evaluator& evaluator, const simulation::Sensitivities& sensitivities, const Model& model,
                 const calibration::Prediction& prediction, const calibration::Residuals& residuals,
                 std::vector<Nuisance>& nuisances) {
  struct Slope {
    std::shared_ptr<const simulation::ChainDerivative> motion;
    Eigen::VectorXd distances;
  };
  std::map<std::string, Slope> slopes;  // of what is another number in each pose, for all poses at once
  for (const Nuisance& nuisance : nuisances) slopes[nuisance.setting()];
  std::vector<std::string> names;
  for (const auto& [name, slope] : slopes) names.push_back(name);
  std::vector<simulation::ChainDerivative> motions = sensitivities.of(names);
  auto next = motions.begin();
  for (auto& [name, slope] : slopes) {
    slope.motion = std::make_shared<const simulation::ChainDerivative>(std::move(*next++));
    slope.distances = slope_at(evaluator, model, prediction, residuals, name, *slope.motion);
  }
  const auto& measurements = evaluator.scene().measurements;
  for (Nuisance& nuisance : nuisances) {
    const bool base = nuisance.effect.empty();
    const std::string name = nuisance.setting();
    const Slope& slope = slopes.at(name);
    nuisance.motion = slope.motion;
    nuisance.motion_per_sigma = nuisance.sigma * (base ? simulation::base_setting(model, name).value : 1);
    nuisance.shape_mm = nuisance.motion_per_sigma * slope.distances;
    for (Eigen::Index r = 0; r < residuals.size(); ++r)
      if (!nuisance.pose.empty() &&
          measurements[static_cast<std::size_t>(residuals.pose[r])]->pose.name != nuisance.pose)
        nuisance.shape_mm[r] = 0;
  }
}

}  // namespace supine::diagnosis
