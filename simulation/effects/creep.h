// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Creep, seen as a stiffness per pose: Young's modulus of the breast times exp(-log_softening) in the imaged pose,
/// where it has hung for half an hour, and unchanged in every other. Without another pose it is nothing but another
/// modulus.
class Creep : public Effect {
 public:
  std::string name() const override { return "creep"; }
  std::string meaning() const override { return "tissue that has softened while the breast hung in the scanner"; }
  EffectTraits traits() const override { return {.acts_in = ActsIn::imaged_only}; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
