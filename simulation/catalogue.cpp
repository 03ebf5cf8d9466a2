// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/catalogue.h"

#include "simulation/effects/adhesion.h"
#include "simulation/effects/gravity_tilt.h"
#include "simulation/effects/ligament.h"
#include "simulation/effects/stiffness_gradient.h"
#include "simulation/effects/strain_stiffening.h"
#include "simulation/effects/tissue_stiffness.h"

namespace supine::simulation {

const std::vector<OptionRow>& Effect::options() const {
  static const std::vector<OptionRow> none;
  return none;
}

const std::vector<const Effect*>& catalogue() {
  using segmentation::Tissue;
  static const Ligament ligament;
  static const Adhesion adhesion;
  static const StrainStiffening strain_stiffening;
  static const TissueStiffness gland(
      Tissue::gland, {"log_ratio", "1", 0, -1.5, 3, 1.5, 0.7, false, "ln of gland stiffness over fat stiffness"});
  static const TissueStiffness tumour(
      Tissue::tumour, {"log_ratio", "1", 0, 0, 2.6, 1.5, 0.7, true, "ln of tumour stiffness over fat stiffness"});
  static const StiffnessGradient stiffness_gradient;
  static const GravityTilt gravity_tilt;
  static const std::vector<const Effect*> all = {&adhesion, &ligament,           &strain_stiffening, &gland,
                                                 &tumour,   &stiffness_gradient, &gravity_tilt};
  return all;
}

const Effect* find_effect(const std::string& name) {
  for (const Effect* effect : catalogue())
    if (effect->name() == name) return effect;
  return nullptr;
}

const std::vector<Parameter>& base_parameters() {
  static const std::vector<Parameter> rows = {
      {"breast.young_modulus_kpa", "kPa", 0, 1e-3, 1e4, 0.5, 0.7, true, "Young's modulus of the breast"},
      {"breast.poisson_ratio", "1", 0, 0, 0.4999, 0.45, 0.05, true, "Poisson's ratio of the breast, below 0.5"},
      {"breast.density_kg_m3", "kg/m3", 0, 1, 5000, 1000, 0.05, true, "density of the breast"},
      {"skin.young_modulus_kpa", "kPa", 0, 0, 1e6, 20, 0.8, true, "Young's modulus of the skin; 0 = no skin membrane"},
      {"skin.thickness_mm", "mm", 0, 1e-3, 10, 1.5, 0.3, true, "thickness of the skin"},
      {"skin.compression_share", "1", 0, 0, 1, 0.05, 0.5, true,
       "share of the full energy kept where the skin wrinkles"},
      {"skin.poisson_ratio", "1", 0, 0, 0.4999, 0.45, 0.05, true, "Poisson's ratio of the corotational skin"},
      {"interface.normal_kpa_per_mm", "kPa/mm", 0, 1e-6, 1e6, 3, 1, true, "stiffness against leaving the muscle"},
      {"interface.tangential_kpa_per_mm", "kPa/mm", 0, 1e-9, 1e6, 0.01, 1, true, "stiffness against sliding, > 0"},
      {"cut.stiffness_kpa_per_mm", "kPa/mm", 0, 1e-6, 1e6, 1, 1, true, "stiffness of the body behind the cut"}};
  return rows;
}

}  // namespace supine::simulation
