// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Tissue that stiffens with strain: I1 - 3 becomes (e^{b (I1 - 3)} - 1)/b. For the neo_hookean law.
class StrainStiffening : public Effect {
 public:
  std::string name() const override { return "strain_stiffening"; }
  std::string meaning() const override { return "tissue that stiffens as it stretches (neo_hookean law)"; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
