// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// The circum-mammary ligament (McGhee): a ring at the mound's foot where the inner surface is held to the muscle.
/// Adds stiffness_kpa_per_mm to the tangential and the normal interface stiffness inside the ring, with cosine edges
/// so that the answer moves smoothly with the ring's place.
class Ligament : public Effect {
 public:
  std::string name() const override { return "ligament"; }
  std::string meaning() const override { return "ring at the mound's foot that ties the breast to the muscle"; }
  EffectTraits traits() const override { return {.kind = EffectKind::boundary, .breast_only = true}; }
  const std::vector<Parameter>& parameters() const override;
  const std::vector<OptionRow>& options() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
