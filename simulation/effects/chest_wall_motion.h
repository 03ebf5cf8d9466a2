// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// The rigid muscle is somewhere else than in the image: under the mound it has come out along its normal by
/// amplitude_mm in the middle of the foot, fading smoothly to nothing at the foot's mean radius, unless centre
/// and radius say otherwise. Every pose but the imaged one.
class ChestWallMotion : public Effect {
 public:
  std::string name() const override { return "chest_wall_motion"; }
  std::string meaning() const override { return "chest wall that has another shape than in the scanner"; }
  EffectTraits traits() const override {
    return {.kind = EffectKind::boundary,
            .acts_in = ActsIn::all_but_imaged,
            .error_source = "chest_wall",
            .breast_only = true,
            .error_of_each_scan = true};
  }
  double tolerance(const std::string& unit, const MeasurementTolerances& known) const override {
    return unit == "1" ? 0 : known.chest_wall_mm;
  }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
