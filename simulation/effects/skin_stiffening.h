// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Skin that stiffens with strain: in its energy μ/2 w the invariant w = I1s + 1/det Cs - 3 becomes (e^{b w} - 1)/b.
/// For the neo_hookean skin.
class SkinStiffening : public Effect {
 public:
  std::string name() const override { return "skin_stiffening"; }
  std::string meaning() const override { return "skin that stiffens as it stretches (neo_hookean skin)"; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
