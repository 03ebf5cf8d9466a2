// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/model_checks.h"

#include <fmt/core.h>

#include "common/error.h"
#include "simulation/solve/chain.h"

namespace supine::pipeline {

void check_weight(const simulation::Model& model, const meshing::Anatomy& anatomy, const std::filesystem::path& file) {
  constexpr double least = 0.002;
  const double load = simulation::load_number(anatomy, model), modulus_kpa = model.breast.young_modulus_kpa.value;
  if (load >= least) return;
  throw InputError(fmt::format(
      "{}: breast.young_modulus_kpa = {:g} kPa is so stiff that the weight of this breast would hardly strain it "
      "(ρ g H / E = {:.2g} over a height of {:.0f} mm, bound {}). Breasts have 0.1 to 20 kPa; was it "
      "written in Pa?",
      file.string(), modulus_kpa, load, anatomy.mound_height_mm, least));
}

}  // namespace supine::pipeline
