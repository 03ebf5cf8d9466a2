// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "calibration/scan.h"
#include "meshing/tet_mesh.h"
#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {

/// Where the points of a mesh are in a pose.
struct PosePoints {
  std::string pose;
  const Points* x;  ///< #N by 3, mm
};

/// What every tool asks of a scan before it believes a distance: its frame, whether another reading fits far better
/// (registration/plausibility.h), whether it lies at the body. Warns where its side is not verified. An object has no
/// side, and may well look the same from several: of its scan only frame and place are asked.
/// @param skin    of the pose as predicted
/// @param others  shapes of further poses, as far as they are known; the imaged one is added
/// @throws InputError  naming the scan's file, the reading that fits, and what to do
void check_scan(Run& run, const Case& measured, const Pose& pose, const calibration::Scan& scan,
                const meshing::TetMesh& mesh, const calibration::ModelSkin& skin, const Points& x,
                const std::vector<PosePoints>& others);

}  // namespace supine::pipeline
