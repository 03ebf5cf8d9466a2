// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/scan_readings.h"

#include <list>

#include "registration/plausibility.h"

namespace supine::pipeline {

void check_scan(Run& run, const Case& measured, const Pose& pose, const calibration::Scan& scan,
                const meshing::TetMesh& mesh, const calibration::ModelSkin& skin, const Points& x,
                const std::vector<PosePoints>& others) {
  const std::string name = pose.surface->string();
  // A body may hang beside what holds it: only of a breast does the scan lie on one side.
  if (measured.is_object()) return calibration::check_placement(scan, skin, {}, name);
  calibration::check_frame(scan, skin, mesh.muscle, name);
  std::list<calibration::ModelSkin> skins;
  std::vector<registration::PoseShape> shapes = {{pose.name, &skin, x - mesh.points}};
  const auto add = [&](const std::string& of, const Points& points) {
    shapes.push_back({of, &skins.emplace_back(mesh, points), points - mesh.points});
  };
  for (const PosePoints& other : others)
    if (other.pose != pose.name && other.x->rows() == mesh.points.rows()) add(other.pose, *other.x);
  add(measured.imaged_pose, mesh.points);
  const auto readings = registration::examine_readings(scan, shapes);
  // A warning goes into sidecars, which do not depend on where the case lies.
  const std::string told = readings.better ? name : pose.surface->filename().string();
  const std::string doubt = registration::check_readings(readings, pose.name, pose.landmarks.has_value(), told);
  calibration::check_placement(scan, skin, mesh.muscle, name);
  if (!doubt.empty()) run.warn(doubt);
}

}  // namespace supine::pipeline
