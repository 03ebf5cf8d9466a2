// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// The skin of the segmentation is not where the body's is: true skin = imaged skin moved by offset_mm along its
/// outward normal. Sets Fields::imaged_offset, and with it the known shape of every pose's undeformed shape; see
/// skin_offset.h for how the nodes inside follow.
class SegmentationOffset : public Effect {
 public:
  std::string name() const override { return "segmentation_offset"; }
  std::string meaning() const override { return "imaged skin drawn too far in or out"; }
  EffectTraits traits() const override { return {.kind = EffectKind::measurement, .error_source = "segmentation"}; }
  double tolerance(const std::string&, const MeasurementTolerances& known) const override {
    return known.segmentation_mm;
  }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
