// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/scan_case.h"

#include <fmt/core.h>

#include <algorithm>

#include "calibration/measured_landmarks.h"
#include "calibration/surface_topology.h"
#include "common/error.h"
#include "common/suggestion.h"
#include "pipeline/case/shape_gravity.h"
#include "reconstruction/surface_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

bool lies_on(const ScanCase& in, const char* what) {
  return std::find(in.on.begin(), in.on.end(), what) != in.on.end();
}

std::string toml_of(const Case& description) { return (description.folder / "case.toml").string(); }

/// Unit normals of the scan's points, neighbours agreeing; zero where there is none, as of a contour.
Points normals_of(const reconstruction::Surface& scan) {
  Triangles triangles = scan.triangles;
  if (triangles.rows() > 0) calibration::orient_pieces(calibration::SurfaceTopology(scan.points, triangles), triangles);
  return calibration::SurfaceDistance(scan.points, triangles).normals();
}

void check_rigid_names(const Case& description, const Landmarks& measured) {
  for (const std::string& name : description.register_on.rigid)
    if (!measured.row_of(name))
      throw InputError(fmt::format("{}: [register] rigid names the landmark '{}', which the pose does not have; {}",
                                   toml_of(description), name, suggestion(name, measured.names)));
}

/// Landmarks that the scan and the body share: rigid ones where the image has them, others where the model has them.
void add_landmarks(const Case& description, const Pose& pose, const fs::path& shape, ScanCase& in) {
  const Landmarks& measured = *in.landmarks;
  check_rigid_names(description, measured);
  const Landmarks imaged = read_landmarks(in.read.emplace_back(*description.prone_landmarks), description.frame);
  Landmarks predicted;
  if (const fs::path file = shape.parent_path() / (shape.stem().string() + "_landmarks.csv"); fs::exists(file))
    predicted = read_landmarks(in.read.emplace_back(file));
  const std::vector<std::string>& rigid = description.register_on.rigid;
  for (std::size_t l = 0; l < measured.names.size(); ++l) {
    const std::string& name = measured.names[l];
    const auto before = imaged.row_of(name), after = predicted.row_of(name);
    registration::Landmark shared{name, measured.points.row(static_cast<Eigen::Index>(l)), {}, Eigen::Vector3d::Zero()};
    shared.rigid = std::find(rigid.begin(), rigid.end(), name) != rigid.end();
    if (shared.rigid && before) {
      shared.image = imaged.points.row(*before);
    } else if (!shared.rigid && after && before) {
      shared.image = predicted.points.row(*after);
      shared.displacement = predicted.points.row(*after) - imaged.points.row(*before);
    } else {
      continue;
    }
    shared.sigma_mm = calibration::pair_sigma_mm(imaged, *before, measured, static_cast<Eigen::Index>(l));
    in.problem.landmarks.push_back(shared);
  }
  if (in.problem.landmarks.empty())
    throw InputError(
        fmt::format("{}: none of its landmarks ({}) is known on the body: the imaged ones are {}; those of the "
                    "pose are predicted by supine-simulate beside {}",
                    pose.landmarks->string(), listed(measured.names), listed(imaged.names), shape.string()));
}

void choose(const Case& description, const Pose& pose, ScanCase& in) {
  in.on = description.register_on.on;
  if (in.on.empty())
    in.on = pose.landmarks ? std::vector<std::string>{"landmarks", "model"} : std::vector<std::string>{"model"};
  if (lies_on(in, "landmarks") && !pose.landmarks)
    throw InputError(fmt::format("{}: [register] on names landmarks, and [pose.{}] has none; name their file there",
                                 toml_of(description), pose.name));
  if (!lies_on(in, "landmarks") && !description.register_on.rigid.empty())
    throw InputError(fmt::format("{}: [register] rigid names landmarks, and on does not; add \"landmarks\" to on",
                                 toml_of(description)));
}

void add_surfaces(ScanCase& in, const fs::path& shape) {
  const meshing::TetMesh& mesh = in.predicted.mesh;
  in.skin = std::make_unique<calibration::ModelSkin>(mesh, in.predicted.positions);
  if (lies_on(in, "model")) {
    in.problem.target.skin = &in.skin->distance();
    in.problem.target.skin_displacement = in.predicted.positions - mesh.points;
  }
  if (!lies_on(in, "support")) return;
  if (mesh.muscle.triangles.rows() == 0)
    throw InputError(fmt::format("{}: [register] on names the support, and this mesh has none", shape.string()));
  in.support = std::make_unique<calibration::SurfaceDistance>(mesh.muscle.points, mesh.muscle.triangles);
  in.problem.target.rigid = in.support.get();
}

}  // namespace

ScanCase read_scan_case(const Case& description, const Pose& pose, const fs::path& shape) {
  if (!pose.surface)
    throw InputError(
        fmt::format("{}: pose '{}' has no surface; nothing to register. Name the measured surface as "
                    "`surface` in [pose.{}]",
                    toml_of(description), pose.name, pose.name));
  if (!fs::exists(shape))
    throw InputError(
        fmt::format("{} is not there: the shape of the pose that the scan is laid on. Run supine-simulate (make "
                    "CASE=... simulate), or name it with --shape",
                    shape.string()));
  ScanCase in;
  choose(description, pose, in);
  in.predicted = meshing::read_pose(in.read.emplace_back(shape), pose.name);
  check_gravity(shape, pose);
  in.scan = reconstruction::read_surface(in.read.emplace_back(*pose.surface), description.frame);
  if (pose.landmarks) in.landmarks = read_landmarks(in.read.emplace_back(*pose.landmarks), description.frame);
  add_surfaces(in, shape);
  in.problem.points = in.scan.points;
  in.problem.normals = normals_of(in.scan);
  if (lies_on(in, "landmarks")) add_landmarks(description, pose, shape, in);
  if (pose.noise_mm) in.problem.noise_mm = *pose.noise_mm;
  in.problem.independent_points = pose.independent_points;
  in.problem.rigid_sigma_mm = description.segmentation_mm.value_or(in.problem.rigid_sigma_mm);
  return in;
}

}  // namespace supine::pipeline
