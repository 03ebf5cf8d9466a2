// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "segmentation/image.h"

namespace supine::pipeline {

/// A frame is three letters: the side of the patient to which x, y and z grow. L or R (left, right), A or P (front,
/// back), S or I (head, feet), one of each pair in any order: "LPS", "RAS", "ALS".

/// LPS directions of the axes of @p frame, one per column; nothing when it is no frame.
std::optional<Eigen::Matrix3d> axes_of_frame(const std::string& frame);

/// A grid whose coordinates were read as LPS but are in another frame, in LPS. The voxels keep their order.
segmentation::Grid in_lps(segmentation::Grid grid, const Eigen::Matrix3d& axes);

}  // namespace supine::pipeline
