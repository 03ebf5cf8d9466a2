// SPDX-License-Identifier: AGPL-3.0-or-later
// Diagnoses of twins: bodies on the model's own mesh, as even and as well placed as they are said to be.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/examine.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {

using supine::testing::Twin;

inline constexpr double twin_noise_mm = 0.3;

/// The scan lies where it is said to, on an even body: what the twins are.
inline Priors twin_priors() {
  Priors priors;
  priors.known.registration_mm = 0.05, priors.known.registration_rad = 0.001;
  priors.known.segmentation_mm = priors.known.chest_wall_mm = 0.05;
  priors.known.gravity_rad = 0.002;
  priors.patchiness = {.tissue = 0.02, .skin = 0.02, .muscle_mm = 0.02};
  priors.scan_shared_mm = 0.02;
  return priors;
}

inline Subject subject_of(const Twin& twin) {
  return {twin.scene(), supine::testing::twin_truth(), supine::testing::twin_truth(), {twin_noise_mm}, nullptr};
}

/// Scan and model share their mesh here, so there is no numerical error to be measured.
inline ExamineOptions twin_options(int refits) {
  ExamineOptions options;
  options.other_meshes = false;
  options.refits = refits;
  options.priors = twin_priors();
  return options;
}

inline std::unique_ptr<Findings> findings_of(const Subject& subject, int refits = 5) {
  return examine(subject, twin_options(refits));
}

inline std::unique_ptr<Findings> findings_of(const Twin& twin, int refits = 5) {
  return findings_of(subject_of(twin), refits);
}

inline simulation::Model twin_with(const std::string& effect, const std::string& parameter, double value) {
  simulation::Model model = supine::testing::twin_truth();
  simulation::EffectSetting setting = free_setting(effect);
  setting.parameters.at(parameter).value = value;
  model.effects = {setting};
  return model;
}

inline bool names(const Diagnosis& diagnosis, const std::string& effect) {
  return std::find(diagnosis.missing.begin(), diagnosis.missing.end(), effect) != diagnosis.missing.end();
}

/// The twin's scan, moved.
inline calibration::Measurement scan_elsewhere(const Twin& twin, const Eigen::RowVector3d& shift_mm) {
  const calibration::Scan& scan = twin.measurement->scan;
  reconstruction::Surface surface;
  surface.points = scan.points().rowwise() + shift_mm;
  surface.triangles = scan.distance().triangles();
  const calibration::ModelSkin skin(twin.mesh, twin.solution.poses[0].x);
  return {twin.measurement->pose, calibration::Scan(surface, skin), twin_noise_mm};
}

/// Row of an effect among the candidates.
inline int row_of(const Findings& found, const std::string& effect) {
  const auto effects = found.effects();
  return static_cast<int>(std::find(effects.begin(), effects.end(), effect) - effects.begin());
}

}  // namespace supine::diagnosis
