// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "common/landmarks.h"
#include "common/outputs.h"
#include "phantom/mri/series.h"
#include "phantom/scan.h"
#include "segmentation/image.h"

namespace supine::phantom {

struct MeasuredPose {
  std::string name;
  Eigen::Vector3d gravity;
  Scan scan;
};

/// All that a case folder tells.
struct CaseContents {
  std::string side;
  double noise_mm = 0.7;
  segmentation::LabelImage labels;  ///< values of Label
  Landmarks prone_landmarks;
  Eigen::Vector3d prone_gravity;
  std::vector<MeasuredPose> poses;
  bool real_size = false;  ///< the model is written with contact with the chest beside the breast, and bending skin
};

/// Writes case.toml, model.toml (the generic base model to start from), labels.nrrd, the scans and landmarks.
/// Bytes depend on the contents and the folder's name alone: no time, no provenance.
/// @throws InputError  what Outputs says
void write_case_folder(const std::filesystem::path& folder, const CaseContents& contents, Outputs& outputs);

/// Writes a made series as a case: mri.nrrd (uint16), case.toml with the automatic recipe of its kind, model.toml; and
/// apart from it the truth, a label volume on the same grid whose values are those of Stuff and of the case's
/// [image.labels].
/// @param truth  .nrrd
void write_series_folder(const std::filesystem::path& folder, const std::filesystem::path& truth,
                         const MadeSeries& made, Series series, Outputs& outputs);

}  // namespace supine::phantom
