// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "simulation/model.h"

namespace supine::pipeline {

/// Reads and checks a model.toml against the parameter tables of the base model and of the effect catalogue.
/// Keys that are absent take the defaults of simulation::Model and of the catalogue.
/// @throws InputError  naming file, line, key, value and bound (and the nearest known name for a misspelt one):
///   unknown key, unknown effect or option, a value out of its range, poisson_ratio >= 0.5, poisson_ratio of an
///   incompressible neo_hookean skin, lower >= upper, value outside [lower, upper]
simulation::Model read_model(const std::filesystem::path& file);

}  // namespace supine::pipeline
