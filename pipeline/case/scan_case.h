// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "calibration/model_skin.h"
#include "common/landmarks.h"
#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "registration/problem.h"

namespace supine::pipeline {

/// A scan of a case and the body it is to be laid on.
struct ScanCase {
  meshing::PoseMesh predicted;                   ///< shape in the pose
  reconstruction::Surface scan;                  ///< as given
  std::optional<Landmarks> landmarks;            ///< in the frame of the scan, as given
  std::vector<std::filesystem::path> read;       ///< files that were read
  std::vector<std::string> on;                   ///< what the scan is laid on
  std::unique_ptr<calibration::ModelSkin> skin;  ///< of the predicted shape; also where it is not laid on
  std::unique_ptr<calibration::SurfaceDistance> support;
  registration::Problem problem;  ///< points into skin and support
};

/// @param shape  .vtu of the pose, as supine-simulate writes it; its landmarks (SHAPE_landmarks.csv) stand beside it
/// @throws InputError  no surface in the pose; [register] asks for landmarks, support or names that are not there;
/// files
ScanCase read_scan_case(const Case& description, const Pose& pose, const std::filesystem::path& shape);

}  // namespace supine::pipeline
