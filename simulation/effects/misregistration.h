// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// The measured surface and its landmarks are not in the frame of the image. Sets Fields::scan_motion of every pose but
/// prone; no shape that is simulated depends on it. With t the shift, R the rotation of the rotation vector
/// (turn_x_rad, turn_y_rad, turn_z_rad) and c the centroid of the scan's true points, a point of the scan as given is
/// the true one moved: y = c + R (y_true - c) + t. A comparison moves the scan back, and needs no more than the scan as
/// given, whose centroid is c + t: y_true = (c + t) + Rᵀ (y - (c + t)) - t.
class Misregistration : public Effect {
 public:
  std::string name() const override { return "misregistration"; }
  std::string meaning() const override { return "scan that does not lie where the image says"; }
  EffectTraits traits() const override {
    return {.kind = EffectKind::measurement,
            .acts_in = ActsIn::all_but_imaged,
            .moves_scan = true,
            .error_source = "registration",
            .error_of_each_scan = true};
  }
  double tolerance(const std::string& unit, const MeasurementTolerances& known) const override {
    return unit == "rad" ? known.registration_rad : known.registration_mm;
  }
  const std::vector<Parameter>& parameters() const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation
