// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// The breast attached to the pectoral muscle instead of sliding on it: k_t × exp(log_factor) on the whole interface.
class Adhesion : public Effect {
 public:
  std::string name() const override { return "adhesion"; }
  std::string meaning() const override { return "inner surface attached to the muscle instead of sliding"; }
  EffectTraits traits() const override {
    return {.kind = EffectKind::boundary, .error_source = "springs", .breast_only = true};
  }
  double tolerance(const std::string&, const MeasurementTolerances& known) const override { return known.spring_log; }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
