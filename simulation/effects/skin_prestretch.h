// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Skin under tension before any load: every stretch of the membrane is multiplied by 1 + excess. The undeformed shape
/// is then not free of stress without gravity; it is the shape the strains are counted from.
class SkinPrestretch : public Effect {
 public:
  std::string name() const override { return "skin_prestretch"; }
  std::string meaning() const override { return "skin already stretched in the undeformed shape"; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
