// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/evidence/nuisances.h"

namespace supine::diagnosis {

/// What a nuisance or a parameter is, for a reader: "supine/misregistration.shift_x_mm" is "where the supine scan lies,
/// along x", "breast.young_modulus_kpa" is "breast young modulus". Takes the names of Nuisance::name() and of a model's
/// free parameters.
std::string words_of(const std::string& name);

/// Something that is never known and ended far from where it was expected. Places of scans are told by themselves.
struct FarNuisance {
  std::string name;      ///< Nuisance::name()
  std::string in_words;  ///< "how stiff the gland is over fat: x 1.8 (1.9 sigma)"
  double sigma;          ///< by how many
};

/// Those that are 1.5 sigma off or more, the furthest first.
std::vector<FarNuisance> far_nuisances(const std::vector<Nuisance>& nuisances);

/// "where the supine scan lies, along x ended 4.6 sigma from where it is expected": the furthest of all, places of
/// scans too, where that is 4 sigma or more. Otherwise empty.
std::string too_far_words(const std::vector<Nuisance>& nuisances);

}  // namespace supine::diagnosis
