// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

namespace supine::diagnosis {

/// What a nuisance or a parameter is, for a reader: "supine/misregistration.shift_x_mm" is "where the supine scan lies,
/// along x", "breast.young_modulus_kpa" is "breast young modulus". Takes the names of Nuisance::name() and of a model's
/// free parameters.
std::string words_of(const std::string& name);

}  // namespace supine::diagnosis
