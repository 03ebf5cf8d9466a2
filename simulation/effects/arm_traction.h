// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// The arm lies otherwise than in the scanner and pulls on the skin: a dead traction on a smooth patch around
/// q = (0.65, 0.65), toward the armpit, 0.5 foot radii wide, unless centre and radius say otherwise; along the
/// anatomy's lateral and head directions. Every pose but the imaged one.
class ArmTraction : public Effect {
 public:
  std::string name() const override { return "arm_traction"; }
  std::string meaning() const override { return "pull of the raised or lowered arm on the skin near the armpit"; }
  EffectTraits traits() const override {
    return {.kind = EffectKind::boundary, .acts_in = ActsIn::all_but_imaged, .breast_only = true};
  }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
