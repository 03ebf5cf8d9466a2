// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/catalogue.h"

#include <algorithm>

#include "common/error.h"
#include "simulation/effects/adhesion.h"
#include "simulation/effects/arm_traction.h"
#include "simulation/effects/chest_wall_motion.h"
#include "simulation/effects/creep.h"
#include "simulation/effects/fibre_anisotropy.h"
#include "simulation/effects/friction.h"
#include "simulation/effects/gravity_tilt.h"
#include "simulation/effects/incompressibility.h"
#include "simulation/effects/left_right_stiffness.h"
#include "simulation/effects/ligament.h"
#include "simulation/effects/misregistration.h"
#include "simulation/effects/segmentation_offset.h"
#include "simulation/effects/skin_prestretch.h"
#include "simulation/effects/skin_stiffening.h"
#include "simulation/effects/stiffness_gradient.h"
#include "simulation/effects/strain_stiffening.h"
#include "simulation/effects/tissue_stiffness.h"

namespace supine::simulation {

namespace {

std::vector<const Effect*>& entries() {
  using segmentation::Tissue;
  static const Ligament ligament;
  static const Adhesion adhesion;
  static const StrainStiffening strain_stiffening;
  static const FibreAnisotropy fibre_anisotropy;
  static const Incompressibility incompressibility;
  static const TissueStiffness gland(
      Tissue::gland, {"log_ratio", "1", 0, -1.5, 3, 1.5, 0.7, false, "ln of gland stiffness over fat stiffness"});
  static const TissueStiffness tumour(
      Tissue::tumour, {"log_ratio", "1", 0, 0, 2.6, 1.5, 0.7, true, "ln of tumour stiffness over fat stiffness"});
  static const StiffnessGradient stiffness_gradient;
  static const LeftRightStiffness left_right_stiffness;
  static const SkinPrestretch skin_prestretch;
  static const SkinStiffening skin_stiffening;
  static const Friction friction;
  static const Creep creep;
  static const ArmTraction arm_traction;
  static const ChestWallMotion chest_wall_motion;
  static const GravityTilt gravity_tilt;
  static const Misregistration misregistration;
  static const SegmentationOffset segmentation_offset;
  static std::vector<const Effect*> all = {
      &adhesion, &ligament,     &friction,           &strain_stiffening,    &fibre_anisotropy, &incompressibility,
      &gland,    &tumour,       &stiffness_gradient, &left_right_stiffness, &skin_prestretch,  &skin_stiffening,
      &creep,    &arm_traction, &chest_wall_motion,  &gravity_tilt,         &misregistration,  &segmentation_offset};
  return all;
}

}  // namespace

const std::vector<const Effect*>& catalogue() { return entries(); }

bool add_to_catalogue(const Effect& effect) {
  if (find_effect(effect.name()) != nullptr)
    throw InputError("the catalogue has an effect \"" + effect.name() + "\" already; give yours another name");
  entries().push_back(&effect);
  return true;
}

const Effect* find_effect(const std::string& name) {
  for (const Effect* effect : catalogue())
    if (effect->name() == name) return effect;
  return nullptr;
}

EffectTraits traits_of(const std::string& effect) {
  const Effect* found = find_effect(effect);
  return found == nullptr ? EffectTraits{} : found->traits();
}

bool is_measurement_effect(const std::string& effect) {
  const EffectKind kind = traits_of(effect).kind;
  return kind == EffectKind::measurement || kind == EffectKind::numerical;
}

const Effect& place_of_scan() {
  return **std::find_if(catalogue().begin(), catalogue().end(),
                        [](const Effect* effect) { return effect->traits().moves_scan; });
}

const std::vector<Parameter>& base_parameters() {
  static const std::vector<Parameter> rows = {
      {"breast.young_modulus_kpa", "kPa", 0, 1e-3, 1e4, 0.5, 0.7, true, "Young's modulus of the breast"},
      {"breast.poisson_ratio", "1", 0, 0, 0.4999, 0.45, 0.05, true, "Poisson's ratio of the breast, below 0.5"},
      {"breast.mooney_share", "1", 0, 0, 1, 0.5, 0.3, true, "share of C01 in C10 + C01 of the mooney_rivlin law"},
      {"breast.yeoh_c2_ratio", "1", 0, 0, 100, 1, 0.7, true, "C2/C1 of the yeoh law"},
      {"breast.yeoh_c3_ratio", "1", 0, 0, 100, 0, 0.7, true, "C3/C1 of the yeoh law"},
      {"breast.gent_limit", "1", 0, 0.1, 1000, 4, 0.7, true, "Jm of the gent law: limit of I1 - 3 - 2 ln J"},
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
