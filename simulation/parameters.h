// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "simulation/catalogue.h"
#include "simulation/model.h"

namespace supine::simulation {

// Parameters are named by where they stand in model.toml: "breast.young_modulus_kpa" for one of the base model,
// "ligament.stiffness_kpa_per_mm" for one of an effect.

std::string parameter_name(const Effect& effect, const Parameter& row);

/// Its row. @return nullptr when neither the base model nor the catalogue has it
const Parameter* find_parameter(const std::string& name);

/// The number of the base model that the base row @p name stands for. @throws InputError  no such row
Setting& base_setting(Model& model, const std::string& name);
const Setting& base_setting(const Model& model, const std::string& name);

/// Why the base row @p name means nothing to the laws of this model; empty where it means something.
/// @throws InputError  no such row
std::string why_not_of(const Model& model, const std::string& name);

/// The number that @p name stands for in this model, or nullptr: no such parameter, or its effect is not in the model.
Setting* find_setting(Model& model, const std::string& name);

/// Names of what calibration may change: free numbers of the base model in the order of base_parameters(), then those
/// of the model's effects in the order of the catalogue.
std::vector<std::string> free_parameters(const Model& model);

/// The effect with every parameter at its null, all fixed, and its default options.
EffectSetting null_setting(const Effect& effect);

}  // namespace supine::simulation
