// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pipeline/case/model_file.h"
#include "simulation/catalogue.h"

namespace supine::pipeline {

/// NAME=VALUE words, by name. @throws InputError  a word without either
std::map<std::string, std::string> chosen_values(const std::vector<std::string>& words);

/// The [[effect]] block that stands for @p effect in a model.toml: everything free, from the catalogue's median
/// with the catalogue's spread and bounds; units and meanings as comments.
/// @param chosen  in place of medians and defaults: of a parameter a number, of an option its value, by name
/// @throws InputError  the effect has no such name, a value it cannot have
std::string effect_block(const simulation::Effect& effect, const std::map<std::string, std::string>& chosen = {});

/// The text of a model.toml with the effect added at the end; everything else, comments too, stays byte for byte.
/// @param chosen  as in effect_block()
/// @throws InputError  unknown effect, effect in the text already, no TOML, as effect_block()
std::string with_effect(const ModelText& model, const std::string& name,
                        const std::map<std::string, std::string>& chosen = {});

/// The text of a model.toml without the block of the effect: from its [[effect]] line to the next table. Comments
/// that stand right above the next table belong to that and stay.
/// @throws InputError  effect not in the text
std::string without_effect(const ModelText& model, const std::string& name);

/// The text of a model.toml with other values of parameters, fixed or free; everything else, comments too, stays byte
/// for byte.
/// @param values  by name (parameters.h), of a bound NAME.lower or NAME.upper; written with all their digits
/// @throws InputError  a parameter whose number the text does not hold
std::string with_values(const ModelText& model, const std::map<std::string, double>& values);

}  // namespace supine::pipeline
