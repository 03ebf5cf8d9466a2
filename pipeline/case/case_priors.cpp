// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case_priors.h"

#include <numbers>

namespace supine::pipeline {
namespace {

constexpr double radians = std::numbers::pi / 180;
constexpr double turn_per_mm = 0.75 * radians;  // 1.5 degrees go with 2 mm

void apply(const std::optional<double>& registration_mm, const std::optional<double>& registration_deg,
           simulation::MeasurementTolerances& known) {
  if (registration_mm) {
    known.registration_mm = *registration_mm;
    known.registration_rad = turn_per_mm * *registration_mm;
  }
  if (registration_deg) known.registration_rad = radians * *registration_deg;
}

}  // namespace

diagnosis::Priors case_priors(const Case& description, const KnownOptions& options) {
  diagnosis::Priors priors;
  priors.expected = description.expected;
  if (const auto& said = options.segmentation_mm ? options.segmentation_mm : description.segmentation_mm)
    priors.known.segmentation_mm = *said;
  if (options.chest_wall_mm) priors.known.chest_wall_mm = *options.chest_wall_mm;
  apply(options.registration_mm, {}, priors.known);
  for (const Pose& pose : description.poses) {
    const Known& said = pose.known;
    diagnosis::KnownOfPose own{priors.known, said.noise_shared_mm.value_or(priors.scan_shared_mm),
                               pose.independent_points};
    if (!options.registration_mm) apply(said.registration_mm, said.registration_deg, own.known);
    if (said.gravity_deg) own.known.gravity_rad = radians * *said.gravity_deg;
    if (said.breath_mm && !options.chest_wall_mm) own.known.chest_wall_mm = *said.breath_mm;
    priors.of_pose.emplace(pose.name, own);
  }
  return priors;
}

}  // namespace supine::pipeline
