// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// One side of the breast stiffer than the other: ln E += lateral × q_lateral + head × q_head.
class StiffnessGradient : public Effect {
 public:
  std::string name() const override { return "stiffness_gradient"; }
  std::string meaning() const override { return "stiffness that varies from medial to lateral or from foot to head"; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
