// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Tissue that keeps its volume better (a > 0) or worse than the base model says: ν becomes 0.5 - (0.5 - ν) e^{-a}.
class Incompressibility : public Effect {
 public:
  std::string name() const override { return "incompressibility"; }
  std::string meaning() const override { return "tissue nearer to, or further from, keeping its volume"; }
  EffectTraits traits() const override { return {.kind = EffectKind::numerical, .error_source = "numerical"}; }
  double tolerance(const std::string&, const MeasurementTolerances& known) const override {
    return known.incompressibility;
  }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
