// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/parameters.h"

#include <algorithm>

#include "common/error.h"
#include "simulation/catalogue.h"

namespace supine::simulation {
namespace {

const BaseParameter* find_base_row(const std::string& name) {
  for (const BaseParameter& row : base_parameters())
    if (row.name == name) return &row;
  return nullptr;
}

const BaseParameter& base_row(const std::string& name) {
  if (const BaseParameter* row = find_base_row(name)) return *row;
  throw InputError("there is no base parameter '" + name + "'");
}

}  // namespace

std::string parameter_name(const Effect& effect, const Parameter& row) { return effect.name() + "." + row.name; }

const Parameter* find_parameter(const std::string& name) {
  if (const BaseParameter* row = find_base_row(name)) return row;
  const auto dot = name.find('.');
  const Effect* effect = find_effect(name.substr(0, dot));
  if (effect == nullptr || dot == std::string::npos) return nullptr;
  for (const Parameter& row : effect->parameters())
    if (row.name == name.substr(dot + 1)) return &row;
  return nullptr;
}

Setting& base_setting(Model& model, const std::string& name) { return base_row(name).in(model); }

const Setting& base_setting(const Model& model, const std::string& name) { return base_row(name).in_const(model); }

std::string why_not_of(const Model& model, const std::string& name) {
  const BaseParameter& row = base_row(name);
  const bool read = row.bulk_law.value_or(model.breast.law) == model.breast.law &&
                    row.skin_law.value_or(model.skin.law) == model.skin.law;
  return read ? std::string() : row.why_not;
}

Setting* find_setting(Model& model, const std::string& name) {
  if (const BaseParameter* row = find_base_row(name)) return &row->in(model);
  for (EffectSetting& effect : model.effects)
    if (name.starts_with(effect.name + ".")) {
      const auto found = effect.parameters.find(name.substr(effect.name.size() + 1));
      if (found != effect.parameters.end()) return &found->second;
    }
  return nullptr;
}

std::vector<std::string> free_parameters(const Model& model) {
  std::vector<std::string> names;
  for (const BaseParameter& row : base_parameters())
    if (row.in_const(model).free) names.push_back(row.name);
  for (const Effect* effect : catalogue()) {
    const auto present = std::find_if(model.effects.begin(), model.effects.end(),
                                      [effect](const EffectSetting& s) { return s.name == effect->name(); });
    if (present == model.effects.end()) continue;
    for (const Parameter& row : effect->parameters()) {
      const auto setting = present->parameters.find(row.name);
      if (setting != present->parameters.end() && setting->second.free) names.push_back(parameter_name(*effect, row));
    }
  }
  return names;
}

EffectSetting null_setting(const Effect& effect) {
  EffectSetting setting;
  setting.name = effect.name();
  for (const Parameter& row : effect.parameters()) setting.parameters[row.name].value = row.null;
  for (const OptionRow& row : effect.options()) setting.options[row.name] = row.default_value;
  return setting;
}

}  // namespace supine::simulation
