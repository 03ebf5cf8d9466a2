// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Fibres between muscle and skin that pull when stretched (Cooper's ligaments, fascia): fibre modulus += stiffness.
class FibreAnisotropy : public Effect {
 public:
  std::string name() const override { return "fibre_anisotropy"; }
  std::string meaning() const override { return "fibres from muscle to skin that pull when stretched"; }
  EffectTraits traits() const override { return {.breast_only = true}; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
