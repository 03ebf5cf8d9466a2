// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Coulomb friction where the breast presses on the muscle: see InterfaceTerm for the law. It acts on the way from the
/// undeformed shape to each pose, so slip is measured from there. It has no energy.
class Friction : public Effect {
 public:
  std::string name() const override { return "friction"; }
  std::string meaning() const override { return "dry friction between the breast and the muscle"; }
  EffectTraits traits() const override { return {.kind = EffectKind::boundary}; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
