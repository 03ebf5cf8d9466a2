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

std::string doubt_of_skin(const simulation::Model& model) {
  const double skin_kpa = model.skin.young_modulus_kpa.value, tissue_kpa = model.breast.young_modulus_kpa.value;
  if (skin_kpa >= tissue_kpa) return {};
  return fmt::format(
      "skin.young_modulus_kpa = {:g} kPa is softer than the tissue under it ({:g} kPa), so that it is as if there were "
      "no "
      "skin; skin has 5 to 500 kPa. Was it written in MPa?",
      skin_kpa, tissue_kpa);
}

}  // namespace supine::pipeline
