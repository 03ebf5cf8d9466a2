// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "meshing/anatomy.h"
#include "simulation/model.h"

namespace supine::pipeline {

/// Refuses a modulus that the breast's own weight cannot be felt in: ρ g H / E under 0.002, H the height of the mound.
/// Then every pose is the imaged one, and E was most likely written in Pa, or E of another body.
/// @param file  of the model, for the message
/// @throws InputError  with modulus, weight and height
void check_weight(const simulation::Model& model, const meshing::Anatomy& anatomy, const std::filesystem::path& file);

/// What to doubt of a skin that is softer than the tissue under it, as one in MPa is. Empty: nothing.
std::string doubt_of_skin(const simulation::Model& model);

}  // namespace supine::pipeline
