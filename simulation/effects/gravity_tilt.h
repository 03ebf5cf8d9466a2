// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// The patient does not lie as the case says: gravity of every pose but the imaged one turned about the patient's
/// head-foot axis (roll) and left-right axis (pitch), right-handed.
class GravityTilt : public Effect {
 public:
  std::string name() const override { return "gravity_tilt"; }
  std::string meaning() const override { return "gravity of the measured poses points elsewhere than the case says"; }
  EffectTraits traits() const override {
    return {.kind = EffectKind::measurement,
            .acts_in = ActsIn::all_but_imaged,
            .error_source = "gravity",
            .error_of_each_scan = true};
  }
  double tolerance(const std::string&, const MeasurementTolerances& known) const override { return known.gravity_rad; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
