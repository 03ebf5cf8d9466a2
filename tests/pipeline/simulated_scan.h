// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>

namespace supine::pipeline {

/// Writes the skin of a pose with noise of 0.2 mm along its normals: a scan of a body that lacks nothing.
/// @param shift_mm  by which it lies elsewhere
void write_simulated_scan(const std::filesystem::path& pose_file, const std::filesystem::path& scan,
                          const Eigen::RowVector3d& shift_mm = Eigen::RowVector3d::Zero());

}  // namespace supine::pipeline
