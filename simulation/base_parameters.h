// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "simulation/model.h"
#include "simulation/parameter.h"

namespace supine::simulation {

/// One number of the base model. Its median is the default that model.h gives it.
struct BaseParameter : Parameter {
  Setting& (*in)(Model&);                    ///< the number that the row stands for
  const Setting& (*in_const)(const Model&);  ///< the same one, to read
  std::optional<BulkLaw> bulk_law{};         ///< the one law of breast.law that reads it; none: it belongs to no law
  int law_shape = 0;                         ///< with bulk_law: 1 or 2, its column Fields::law_shape_1 or law_shape_2
  std::optional<SkinLaw> skin_law{};         ///< the one law of skin.law that reads it; none: it belongs to no law
  std::string why_not{};                     ///< with a law: why it means nothing to the others, and what to do
};

/// Rows of the base model, named by their place in model.toml: "breast.young_modulus_kpa", "skin.thickness_mm", …
const std::vector<BaseParameter>& base_parameters();

}  // namespace supine::simulation
