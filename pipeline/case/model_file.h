// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "diagnosis/evidence/patchiness.h"
#include "simulation/model.h"

namespace supine::pipeline {

/// Upper bound of [skin] fade_mm.
inline constexpr double longest_skin_fade_mm = 50;
/// The same of [skin] bending_share.
inline constexpr double most_skin_bending = 1000;

/// What stands in a model.toml, or is to stand there.
struct ModelText {
  std::filesystem::path file;  ///< what messages name
  std::string text;
};

/// @throws InputError  the file cannot be read
ModelText read_model_text(const std::filesystem::path& file);

/// Reads and checks a model.toml against the parameter tables of the base model and of the effect catalogue.
/// Keys that are absent take the defaults of simulation::Model and of the catalogue.
/// @throws InputError  naming file, line, key, value and bound (and the nearest known name for a misspelt one):
///   unknown key, unknown effect or option, a value out of its range, poisson_ratio >= 0.5, poisson_ratio of an
///   incompressible neo_hookean skin, lower >= upper, value outside [lower, upper]
simulation::Model read_model(const ModelText& text);
simulation::Model read_model(const std::filesystem::path& file);

/// [patchiness] of the same file: how uneven the body is taken to be. Read and checked by read_model() as well.
/// @throws InputError  as read_model(): standard deviations of logarithms 0 to 2, lengths 5 to 200 mm, muscle 0 to 10
/// mm
diagnosis::Patchiness read_patchiness(const ModelText& text);
diagnosis::Patchiness read_patchiness(const std::filesystem::path& file);

}  // namespace supine::pipeline
