// SPDX-License-Identifier: AGPL-3.0-or-later
// Which readings of a scan are refused: the scans of a case as they are, and each spoilt in the ways people spoil them.
//   bench_scan_readings CASE OUT     OUT: shapes of the poses, as supine-simulate writes them
// One line a trial: case, pose, what was done, refused or not, misfit as given, mirrored and as the reading that fits
// far better, that reading. Only the scans as they are: bench_scan_readings CASE OUT true
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "common/error.h"
#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "reconstruction/surface_io.h"
#include "registration/plausibility.h"

namespace {

using namespace supine;
namespace fs = std::filesystem;

struct Spoilt {
  std::string name;
  std::function<void(Points&)> change;
};

std::vector<Spoilt> spoilings() {
  std::vector<Spoilt> all = {{"as it is", [](Points&) {}}};
  const auto about_centre = [](const Eigen::Matrix3d& by) {
    return [by](Points& p) {
      const Eigen::RowVector3d centre = p.colwise().mean();
      p = ((p.rowwise() - centre) * by.transpose()).rowwise() + centre;
    };
  };
  const auto diagonal = [](double x, double y, double z) {
    return Eigen::Matrix3d(Eigen::Vector3d(x, y, z).asDiagonal());
  };
  all.push_back({"mirrored about x = 0", [](Points& p) { p.col(0) *= -1; }});
  all.push_back({"mirrored about its centre", about_centre(diagonal(-1, 1, 1))});
  all.push_back({"head for feet", about_centre(diagonal(1, 1, -1))});
  for (int axis = 0; axis < 3; ++axis)
    for (const int quarters : {1, 2, 3})
      all.push_back(
          {fmt::format("turned by {} about {}", 90 * quarters, "xyz"[axis]),
           about_centre(Eigen::AngleAxisd(quarters * std::acos(0.0), Eigen::Vector3d::Unit(axis)).toRotationMatrix())});
  for (int axis = 0; axis < 3; ++axis)
    for (const double shift : {-40.0, -25.0, 25.0, 40.0})
      all.push_back(
          {fmt::format("{:+} mm along {}", shift, "xyz"[axis]), [=](Points& p) { p.col(axis).array() += shift; }});
  for (const double scale : {0.8, 1.25})
    all.push_back({fmt::format("scaled by {}", scale), about_centre(scale * diagonal(1, 1, 1))});
  for (const double scale : {0.8, 1.25, 0.1, 1 / 25.4, 0.001})
    all.push_back({fmt::format("times {:.3g}", scale), [=](Points& p) { p *= scale; }});
  return all;
}

struct Shape {
  std::string pose;
  Points positions;
  std::unique_ptr<calibration::ModelSkin> skin;
};

void report(const std::string& name, const std::string& pose, const std::string& what,
            const std::function<calibration::Scan()>& scan_of, const std::vector<registration::PoseShape>& shapes,
            const reconstruction::Surface& muscle) {
  std::string verdict = "accepted", by = "-";
  registration::Readings found{};
  try {
    const calibration::Scan scan = scan_of();
    found = registration::examine_readings(scan, shapes);
    if (found.better) verdict = "refused", by = found.better->words;
    if (!found.better && found.side_unverified()) by = "side unverified";
    if (!found.better && found.head_unverified())
      by = found.side_unverified() ? "side and upper end unverified" : "upper end unverified";
    if (!found.better) calibration::check_placement(scan, *shapes.front().skin, muscle, "scan");
  } catch (const InputError& error) {
    verdict = "refused", by = std::string("placement: ") + error.what();
  }
  fmt::print("{},{},{},{},{:.2f},{:.2f},{:.2f},\"{}\"\n", name, pose, what, verdict, found.given.misfit_mm,
             found.mirrored ? found.mirrored->misfit_mm : NAN, found.better ? found.better->misfit_mm : NAN, by);
}

void try_pose(const pipeline::Case& measured, const pipeline::Pose& pose, const std::vector<Shape>& shapes,
              const meshing::TetMesh& mesh, bool only_true) {
  std::vector<registration::PoseShape> known;
  for (const bool own : {true, false})
    for (const Shape& shape : shapes)
      if ((shape.pose == pose.name) == own)
        known.push_back({shape.pose, shape.skin.get(), Points(shape.positions - mesh.points)});
  const auto surface = reconstruction::read_surface(*pose.surface, measured.frame);
  for (const Spoilt& spoilt : only_true ? std::vector<Spoilt>{spoilings().front()} : spoilings()) {
    const auto scan = [&] {
      auto changed = surface;
      spoilt.change(changed.points);
      return calibration::Scan(changed, *known.front().skin);
    };
    report(measured.name, pose.name, spoilt.name, scan, known, mesh.muscle);
  }
  if (only_true) return;
  for (const pipeline::Pose& other : measured.poses) {
    if (!other.surface || other.name == pose.name) continue;
    const auto scan = [&] {
      return calibration::Scan(reconstruction::read_surface(*other.surface, measured.frame), *known.front().skin);
    };
    report(measured.name, pose.name, "scan of " + other.name, scan, known, mesh.muscle);
  }
  const auto copied = [&] {
    return calibration::Scan(
        reconstruction::Surface{mesh.points, calibration::ModelSkin(mesh, mesh.points).triangles(), {}},
        *known.front().skin);
  };
  report(measured.name, pose.name, "prone skin", copied, known, mesh.muscle);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) return 2;
  try {
    const pipeline::Case measured = pipeline::read_case(argv[1]);
    std::vector<Shape> shapes;
    meshing::TetMesh mesh;
    for (const pipeline::Pose& pose : measured.poses) {
      const fs::path file = fs::path(argv[2]) / (pose.name + ".vtu");
      if (!fs::exists(file)) continue;
      auto read = meshing::read_pose(file);
      mesh = std::move(read.mesh);
      shapes.push_back({pose.name, read.positions, nullptr});
    }
    for (Shape& shape : shapes) shape.skin = std::make_unique<calibration::ModelSkin>(mesh, shape.positions);
    for (const pipeline::Pose& pose : measured.poses)
      if (pose.surface && fs::exists(fs::path(argv[2]) / (pose.name + ".vtu")))
        try_pose(measured, pose, shapes, mesh, argc == 4);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
