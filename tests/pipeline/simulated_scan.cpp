// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/pipeline/simulated_scan.h"

#include <algorithm>
#include <random>

#include "calibration/model_skin.h"
#include "meshing/mesh_io.h"
#include "reconstruction/surface_io.h"

namespace supine::pipeline {

void write_simulated_scan(const std::filesystem::path& pose_file, const std::filesystem::path& scan,
                          const Eigen::RowVector3d& shift_mm) {
  const meshing::PoseMesh pose = meshing::read_pose(pose_file);
  const calibration::ModelSkin skin(pose.mesh, pose.positions);
  reconstruction::Surface surface;
  surface.points = skin.node_points();
  surface.triangles = skin.triangles();
  for (int& node : surface.triangles.reshaped())
    node = static_cast<int>(std::lower_bound(skin.nodes().begin(), skin.nodes().end(), node) - skin.nodes().begin());
  const Points normals = skin.node_normals();
  constexpr double noise_mm = 0.2;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, noise_mm);
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p)
    surface.points.row(p) += noise(random) * normals.row(p) + shift_mm;
  reconstruction::write_surface(surface, scan);
}

}  // namespace supine::pipeline
