// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/scan.h"

#include <cmath>

#include "phantom/face_grid.h"
#include "phantom/random.h"
#include "simulation/embedding.h"

namespace supine::phantom {
namespace {

constexpr double point_spacing_mm = 2.4;

// Two to four round holes; three in four lie below the breast, where a scanner sees least.
std::vector<char> in_holes(const BodyMesh& body_mesh, const Points& skin, Random& random) {
  std::vector<char> gone(skin.rows(), 0);
  const Eigen::RowVector3d head = body_mesh.anatomy.head.transpose(), middle = skin.colwise().mean();
  const int holes = 2 + static_cast<int>(random.below(3));
  for (int h = 0; h < holes; ++h) {
    const bool below = random.uniform() < 0.75;
    Eigen::Index centre = 0;
    do centre = static_cast<Eigen::Index>(random.below(skin.rows()));
    while (below && (skin.row(centre) - middle).dot(head) > -10);
    const double radius = random.uniform(7, 15);
    for (Eigen::Index i = 0; i < skin.rows(); ++i)
      if ((skin.row(i) - skin.row(centre)).norm() < radius) gone[i] = 1;
  }
  return gone;
}

reconstruction::Surface without(const Points& points, const Triangles& triangles, const std::vector<char>& gone) {
  std::vector<int> number(points.rows(), -1), kept_points, kept;
  for (int t = 0; t < triangles.rows(); ++t) {
    const auto corners = triangles.row(t);
    if (gone[corners[0]] || gone[corners[1]] || gone[corners[2]]) continue;
    kept.push_back(t);
    for (const int c : corners)
      if (number[c] < 0) {
        number[c] = static_cast<int>(kept_points.size());
        kept_points.push_back(c);
      }
  }
  reconstruction::Surface surface{points(kept_points, Eigen::all), triangles(kept, Eigen::all), {}};
  for (Eigen::Index i = 0; i < surface.triangles.size(); ++i) {
    int& corner = surface.triangles.data()[i];
    corner = number[corner];
  }
  return surface;
}

Points with_noise(const Points& points, const Points& normals, const ScanOptions& options, Random& random) {
  Points noisy = points;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    noisy.row(i) += options.noise_mm * random.normal() * normals.row(i);
    for (int k = 0; k < 3; ++k) noisy(i, k) += options.isotropic_mm * random.normal();
    for (const RandomField& field : options.shared)
      noisy.row(i) += field.at(points.row(i).transpose()) * normals.row(i);
  }
  return noisy;
}

}  // namespace

Scan scan_pose(const BodyMesh& body_mesh, const Body& body, const std::string& pose, const Points& x,
               std::uint64_t seed, const ScanOptions& options) {
  Random random(seed, "scan " + pose);
  const std::vector<int> skin_faces = faces_with(body_mesh.mesh, static_cast<int>(reconstruction::Region::skin));
  const double around = 2 * body.reach * body.foot_radius_mm;
  const double edge = around * std::sqrt(2 / static_cast<double>(skin_faces.size()));
  const FaceGrid grid(body_mesh.mesh, skin_faces, std::max(1, static_cast<int>(std::lround(edge / point_spacing_mm))));
  const Points skin = grid.at(x);
  const Points noisy = with_noise(skin, point_normals(skin, grid.triangles()), options, random);
  return {without(noisy, grid.triangles(), in_holes(body_mesh, skin, random)),
          mark_skin(body_mesh, body, pose, x, seed, options.landmarks)};
}

Landmarks mark_skin(const BodyMesh& body_mesh, const Body& body, const std::string& pose, const Points& x,
                    std::uint64_t seed, const LandmarkError& error) {
  Random random(seed, "landmarks " + pose);
  Landmarks marks{{"nipple", "lateral", "medial", "upper", "lower"}, Points(5, 3)};
  const double out = 0.55 / body.reach;
  const Eigen::Vector2d places[] = {{0, 0}, {out, 0}, {-out, 0}, {0, out}, {0, -out}};
  for (int i = 0; i < 5; ++i) marks.points.row(i) = body.world(body.place(places[i], 1)).transpose();
  marks.points = simulation::Embedding(body_mesh.mesh, marks.points).at(x);
  for (Eigen::Index i = 0; i < marks.points.size(); ++i) marks.points.data()[i] += error.sigma_mm * random.normal();
  if (error.stated) marks.sigma_mm = Eigen::VectorXd::Constant(5, error.sigma_mm);
  return marks;
}

}  // namespace supine::phantom
