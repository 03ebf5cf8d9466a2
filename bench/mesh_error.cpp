// SPDX-License-Identifier: AGPL-3.0-or-later
// Difference between two computed poses of one breast on different meshes, on the skin: as a scanner sees it (distance
// between the surfaces) and as a mark on the skin does (distance between the places the same imaged point goes to).
//
//   bench_mesh_error REFERENCE.vtu POSE.vtu ...
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "calibration/surface_distance.h"
#include "common/error.h"
#include "meshing/mesh_io.h"
#include "meshing/topology.h"

namespace supine {
namespace {

using calibration::ClosestPoints;
using calibration::SurfaceDistance;

/// Skin of a pose, curved faces cut into flat pieces: places in the image and in the pose, the same triangles.
struct Skin {
  Points imaged, posed;
  Triangles triangles;
};

Skin skin_of(const std::filesystem::path& file) {
  const meshing::PoseMesh pose = meshing::read_pose(file);
  const int n = pose.mesh.order() == 2 ? 6 : 1;
  std::vector<Eigen::RowVector3d> imaged, posed;
  std::vector<Eigen::RowVector3i> triangles;
  for (Eigen::Index f = 0; f < pose.mesh.faces.rows(); ++f) {
    if (pose.mesh.region[f] != static_cast<int>(reconstruction::Region::skin)) continue;
    const int first = static_cast<int>(imaged.size());
    const auto at = [&](int i, int j) { return first + i * (n + 1) - i * (i - 1) / 2 + j; };
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const double b = static_cast<double>(i) / n, c = static_cast<double>(j) / n;
        imaged.push_back(meshing::face_point(pose.mesh.points, pose.mesh.faces, f, b, c));
        posed.push_back(meshing::face_point(pose.positions, pose.mesh.faces, f, b, c));
        if (i + j < n) triangles.emplace_back(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) triangles.emplace_back(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
  Skin skin{Points(imaged.size(), 3), Points(posed.size(), 3), Triangles(triangles.size(), 3)};
  for (std::size_t i = 0; i < imaged.size(); ++i) {
    skin.imaged.row(static_cast<Eigen::Index>(i)) = imaged[i];
    skin.posed.row(static_cast<Eigen::Index>(i)) = posed[i];
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) skin.triangles.row(static_cast<Eigen::Index>(i)) = triangles[i];
  return skin;
}

Points centroids(const Points& points, const Triangles& triangles) {
  Points out(triangles.rows(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    out.row(t) = (points.row(triangles(t, 0)) + points.row(triangles(t, 1)) + points.row(triangles(t, 2))) / 3;
  return out;
}

double root_mean(const Eigen::VectorXd& squares, const Eigen::VectorXd& weight) {
  return std::sqrt(squares.dot(weight) / weight.sum());
}

void compare(const Skin& reference, const Skin& model, const std::string& name) {
  const Points imaged = centroids(reference.imaged, reference.triangles);
  const Points posed = centroids(reference.posed, reference.triangles);
  const SurfaceDistance in_image(model.imaged, model.triangles), in_pose(model.posed, model.triangles);
  const SurfaceDistance of_reference(reference.posed, reference.triangles);
  const Eigen::VectorXd area = of_reference.areas_mm2();
  ClosestPoints surface, material;
  in_pose.closest(posed, surface);
  in_image.closest(imaged, material);
  Eigen::VectorXd squares(imaged.rows());
  Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
  double signed_mean = 0;
  for (Eigen::Index i = 0; i < imaged.rows(); ++i) {
    Eigen::RowVector3d place = Eigen::RowVector3d::Zero();
    for (int k = 0; k < 3; ++k) place += material.weight(i, k) * model.posed.row(material.node(i, k));
    const Eigen::RowVector3d gap = place - posed.row(i);
    squares[i] = gap.squaredNorm();
    mean += area[i] / area.sum() * gap;
    const Eigen::RowVector3d offset = posed.row(i) - surface.point.row(i);
    signed_mean += area[i] / area.sum() * offset.dot(surface.normal.row(i));
  }
  std::vector<double> sorted(surface.distance_mm.begin(), surface.distance_mm.end());
  std::sort(sorted.begin(), sorted.end());
  fmt::print("{:<40} {:7.3f} {:7.3f} {:7.3f} {:+7.3f}   {:7.3f} {:7.3f}  ({:+.2f} {:+.2f} {:+.2f})  {:.3f}\n", name,
             root_mean(surface.distance_mm.array().square().matrix(), area), sorted[sorted.size() * 95 / 100],
             sorted.back(), signed_mean, root_mean(squares, area), std::sqrt(squares.maxCoeff()), mean.x(), mean.y(),
             mean.z(), root_mean(material.distance_mm.array().square().matrix(), area));
}

}  // namespace
}  // namespace supine

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "bench_mesh_error REFERENCE.vtu POSE.vtu ...\n");
    return 2;
  }
  try {
    const supine::Skin reference = supine::skin_of(argv[1]);
    fmt::print("mm, area-weighted over the reference's skin; signed > 0 where the reference lies outside\n");
    fmt::print("{:<40} {:>7} {:>7} {:>7} {:>7}   {:>7} {:>7}  {:<20} {}\n", "pose", "surface", "p95", "max", "signed",
               "marks", "max", "mean shift x y z", "imaged rms");
    for (int i = 2; i < argc; ++i) supine::compare(reference, supine::skin_of(argv[i]), argv[i]);
  } catch (const supine::InputError& error) {
    fmt::print(stderr, "bench_mesh_error: {}\n", error.what());
    return 2;
  }
  return 0;
}
