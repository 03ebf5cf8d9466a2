// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "simulation/laws/invariant_law_list.h"

namespace supine::simulation {

/// A number of the model: fixed, or free in calibration.
struct Setting {
  double value = 0;
  bool free = false;                 ///< written as a table in model.toml
  std::optional<double> prior_sd{};  ///< same unit as value, > 0
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

#define SUPINE_NAME(name, Law) name,
enum class BulkLaw { SUPINE_INVARIANT_LAWS(SUPINE_NAME) corotational, corotational_qr };
#undef SUPINE_NAME
enum class Volumetric { mean, pointwise };
enum class SkinLaw { neo_hookean, corotational };
enum class Compression { tension_field, full };
enum class InterfaceKind { sliding, elastic, fixed };
enum class CutKind { elastic, held };
enum class ContactKind { off, skin, chest, all };
enum class DensityReference { imaged, undeformed };

/// One [[effect]] of model.toml; parameter and option names are those of its catalogue entry.
struct EffectSetting {
  std::string name;
  std::map<std::string, Setting> parameters;
  std::map<std::string, std::string> options;
};

/// Skin on skin (terms/skin_contact.h), on the chest beside the breast (terms/chest_contact.h), or both: a device that
/// keeps them apart, no belief, so its numbers are not calibrated.
struct ContactSettings {
  ContactKind kind = ContactKind::off;
  double stiffness_kpa_per_mm = 2.0;  ///< > 0
  double band_mm = 1.0;               ///< > 0; gap at which the pressure sets in
  bool with_skin() const { return kind == ContactKind::skin || kind == ContactKind::all; }
  bool with_chest() const { return kind == ContactKind::chest || kind == ContactKind::all; }
};

/// How tissue is held on one support of an object; what is absent is that of [interface].
struct SupportSetting {
  std::optional<InterfaceKind> kind;
  std::optional<double> normal_kpa_per_mm, tangential_kpa_per_mm;
};

/// model.toml: what is believed. Units in the names; moduli are Young's. Every Setting of the base model has a row in
/// base_parameters.cpp; its default here is the median of its prior.
struct Model {
  struct {
    BulkLaw law = BulkLaw::neo_hookean;
    Setting young_modulus_kpa{0.5};
    Setting poisson_ratio{0.45};
    Volumetric volumetric = Volumetric::mean;  ///< quadratic cells near incompressibility
    Setting mooney_share{0.5};                 ///< mooney_rivlin only: C01 / (C10 + C01)
    Setting yeoh_c2_ratio{1.0};                ///< yeoh only: C2 / C1
    Setting yeoh_c3_ratio{0.0};                ///< yeoh only: C3 / C1
    Setting gent_limit{4.0};                   ///< gent only: Jm
    Setting density_kg_m3{1000};
    DensityReference density_refers_to = DensityReference::imaged;
  } breast;
  struct {
    SkinLaw law = SkinLaw::neo_hookean;
    Setting young_modulus_kpa{20};
    Setting thickness_mm{1.5};
    Compression compression = Compression::tension_field;
    Setting compression_share{0.05};
    Setting poisson_ratio{0.45};  ///< corotational skin only
    /// Skin and cut fade over so much where the skin ends, mm, >= 0 (terms/skin_end_fade.h); 0: at full stiffness up to
    /// it. What the body goes on with, no belief, so it is not calibrated.
    double fade_mm = 0;
    /// Share of the bending stiffness of a plate of the skin's thickness, >= 0 (terms/skin_bending.h); not calibrated.
    double bending_share = 0;
  } skin;
  struct {
    InterfaceKind kind = InterfaceKind::sliding;
    Setting normal_kpa_per_mm{3.0};
    Setting tangential_kpa_per_mm{0.01};
  } interface;
  struct {
    CutKind kind = CutKind::elastic;
    Setting stiffness_kpa_per_mm{1.0};
  } cut;
  ContactSettings contact;
  std::map<std::string, SupportSetting> supports;  ///< by name, as the mesh has them
  std::vector<EffectSetting> effects;
  /// What differs from pose to pose, by the pose's name: where its scan lies, how gravity falls in it. Acts after the
  /// effects and on top of them; no parameter stands for its numbers.
  std::map<std::string, std::vector<EffectSetting>> of_pose;
};

}  // namespace supine::simulation
