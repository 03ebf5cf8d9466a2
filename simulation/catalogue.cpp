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
#include "simulation/effects/local_muscle.h"
#include "simulation/effects/local_stiffness.h"
#include "simulation/effects/misregistration.h"
#include "simulation/effects/part_stiffness.h"
#include "simulation/effects/segmentation_offset.h"
#include "simulation/effects/skin_prestretch.h"
#include "simulation/effects/skin_stiffening.h"
#include "simulation/effects/stiffness_gradient.h"
#include "simulation/effects/strain_stiffening.h"
#include "simulation/effects/support_compliance.h"
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
  static const TissueStiffness gland(Tissue::gland, {.name = "log_ratio",
                                                     .unit = "1",
                                                     .lower = -1.5,
                                                     .upper = 3,
                                                     .median = 1.5,
                                                     .spread = 0.7,
                                                     .meaning = "ln of gland stiffness over fat stiffness"});
  static const TissueStiffness tumour(Tissue::tumour, {.name = "log_ratio",
                                                       .unit = "1",
                                                       .lower = 0,
                                                       .upper = 2.6,
                                                       .median = 1.5,
                                                       .spread = 0.7,
                                                       .one_sided = true,
                                                       .meaning = "ln of tumour stiffness over fat stiffness"});
  static const PartStiffness part_stiffness;
  static const SupportCompliance support_compliance;
  static const StiffnessGradient stiffness_gradient;
  static const LocalStiffness local_stiffness;
  static const LeftRightStiffness left_right_stiffness;
  static const SkinPrestretch skin_prestretch;
  static const SkinStiffening skin_stiffening;
  static const Friction friction;
  static const Creep creep;
  static const ArmTraction arm_traction;
  static const ChestWallMotion chest_wall_motion;
  static const LocalMuscle local_muscle;
  static const GravityTilt gravity_tilt;
  static const Misregistration misregistration;
  static const SegmentationOffset segmentation_offset;
  static std::vector<const Effect*> all = {&adhesion,
                                           &ligament,
                                           &support_compliance,
                                           &friction,
                                           &strain_stiffening,
                                           &fibre_anisotropy,
                                           &incompressibility,
                                           &gland,
                                           &tumour,
                                           &part_stiffness,
                                           &stiffness_gradient,
                                           &local_stiffness,
                                           &left_right_stiffness,
                                           &skin_prestretch,
                                           &skin_stiffening,
                                           &creep,
                                           &arm_traction,
                                           &chest_wall_motion,
                                           &local_muscle,
                                           &gravity_tilt,
                                           &misregistration,
                                           &segmentation_offset};
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

bool is_stand_in(const Effect& effect) {
  return dynamic_cast<const LocalStiffness*>(&effect) != nullptr ||
         dynamic_cast<const LocalMuscle*>(&effect) != nullptr;
}

const Effect& place_of_scan() {
  return **std::find_if(catalogue().begin(), catalogue().end(),
                        [](const Effect* effect) { return effect->traits().moves_scan; });
}

}  // namespace supine::simulation
