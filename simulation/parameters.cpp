// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/parameters.h"

#include <algorithm>

#include "common/error.h"
#include "simulation/catalogue.h"

namespace supine::simulation {

std::string parameter_name(const Effect& effect, const Parameter& row) { return effect.name() + "." + row.name; }

const Parameter* find_parameter(const std::string& name) {
  for (const Parameter& row : base_parameters())
    if (row.name == name) return &row;
  const auto dot = name.find('.');
  const Effect* effect = find_effect(name.substr(0, dot));
  if (effect == nullptr || dot == std::string::npos) return nullptr;
  for (const Parameter& row : effect->parameters())
    if (row.name == name.substr(dot + 1)) return &row;
  return nullptr;
}

Setting& base_setting(Model& model, const std::string& name) {
  if (name == "breast.young_modulus_kpa") return model.breast.young_modulus_kpa;
  if (name == "breast.poisson_ratio") return model.breast.poisson_ratio;
  if (name == "breast.mooney_share") return model.breast.mooney_share;
  if (name == "breast.yeoh_c2_ratio") return model.breast.yeoh_c2_ratio;
  if (name == "breast.yeoh_c3_ratio") return model.breast.yeoh_c3_ratio;
  if (name == "breast.gent_limit") return model.breast.gent_limit;
  if (name == "breast.density_kg_m3") return model.breast.density_kg_m3;
  if (name == "skin.young_modulus_kpa") return model.skin.young_modulus_kpa;
  if (name == "skin.thickness_mm") return model.skin.thickness_mm;
  if (name == "skin.compression_share") return model.skin.compression_share;
  if (name == "skin.poisson_ratio") return model.skin.poisson_ratio;
  if (name == "interface.normal_kpa_per_mm") return model.interface.normal_kpa_per_mm;
  if (name == "interface.tangential_kpa_per_mm") return model.interface.tangential_kpa_per_mm;
  if (name == "cut.stiffness_kpa_per_mm") return model.cut.stiffness_kpa_per_mm;
  throw InputError("there is no base parameter '" + name + "'");
}

const Setting& base_setting(const Model& model, const std::string& name) {
  return base_setting(const_cast<Model&>(model), name);
}

std::string why_not_of(const Model& model, const std::string& name) {
  const auto belongs = [&name](const std::string& law) {
    return "belongs to law = \"" + law + "\"; leave it out or choose that law";
  };
  const BulkLaw law = model.breast.law;
  if (name == "breast.mooney_share" && law != BulkLaw::mooney_rivlin) return belongs("mooney_rivlin");
  if (name.starts_with("breast.yeoh_") && law != BulkLaw::yeoh) return belongs("yeoh");
  if (name == "breast.gent_limit" && law != BulkLaw::gent) return belongs("gent");
  if (name == "skin.poisson_ratio" && model.skin.law == SkinLaw::neo_hookean)
    return "the neo_hookean skin is incompressible and has none; leave it out or use law = \"corotational\"";
  return {};
}

Setting* find_setting(Model& model, const std::string& name) {
  for (const Parameter& row : base_parameters())
    if (row.name == name) return &base_setting(model, name);
  for (EffectSetting& effect : model.effects)
    if (name.starts_with(effect.name + ".")) {
      const auto found = effect.parameters.find(name.substr(effect.name.size() + 1));
      if (found != effect.parameters.end()) return &found->second;
    }
  return nullptr;
}

std::vector<std::string> free_parameters(const Model& model) {
  std::vector<std::string> names;
  for (const Parameter& row : base_parameters())
    if (base_setting(model, row.name).free) names.push_back(row.name);
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
