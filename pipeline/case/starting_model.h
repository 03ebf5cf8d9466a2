// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

namespace supine::pipeline {

/// The text of a model.toml to begin with where nothing is known of the tissue: a modulus under which a body so high
/// carries its own weight (load number ρ g H / E of 0.4), free with a wide prior, and the usual skin, interface and
/// cut.
/// @param mound_height_mm  of the imaged breast over its muscle, > 0
/// @throws InputError  a height that no modulus of the admissible range suits
std::string starting_model(double mound_height_mm);

}  // namespace supine::pipeline
