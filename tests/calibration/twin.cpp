// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/calibration/twin.h"

#include <random>

#include "tests/support/shapes.h"

namespace supine::testing {
namespace {

/// A triangle soup on the skin, a little inside each of its triangles.
reconstruction::Surface scan_of(const calibration::ModelSkin& skin, const Twin::Options& options) {
  std::mt19937 generator(options.seed);
  std::normal_distribution<double> normal;
  std::vector<Eigen::RowVector3d> points;
  const Points& x = skin.distance().points();
  for (Eigen::Index t = 0; t < skin.triangles().rows(); ++t) {
    const Eigen::RowVector3d a = x.row(skin.triangles()(t, 0)), b = x.row(skin.triangles()(t, 1)),
                             c = x.row(skin.triangles()(t, 2)), centre = (a + b + c) / 3;
    const Eigen::RowVector3d outward = (b - a).cross(c - a).normalized();
    const bool missing = (options.frame.inverse() * centre.transpose()).x() > options.left_out_from_x;
    for (const Eigen::RowVector3d& corner : {a, b, c}) {
      const double noise = options.noise_mm * normal(generator);
      if (!missing) points.emplace_back(centre + options.shrink * (corner - centre) + noise * outward);
    }
  }
  reconstruction::Surface surface;
  const auto count = static_cast<Eigen::Index>(points.size());
  surface.points.resize(count, 3);
  surface.triangles.resize(count / 3, 3);
  for (Eigen::Index i = 0; i < count; ++i) surface.points.row(i) = points[static_cast<std::size_t>(i)];
  for (Eigen::Index t = 0; t < count / 3; ++t) surface.triangles.row(t) << 3 * t, 3 * t + 1, 3 * t + 2;
  if (options.reversed) {
    surface.points = surface.points.colwise().reverse().eval();
    // Row i has become row n − 1 − i; corners in the order that keeps the orientation.
    for (Eigen::Index t = 0; t < count / 3; ++t) surface.triangles.row(t) << 3 * t + 2, 3 * t + 1, 3 * t;
  }
  return surface;
}

}  // namespace

Twin::Twin(const Options& options) {
  const TestScene& body = options.body != nullptr ? *options.body : dome_scene();
  mesh = moved(body.mesh, options.frame.rotation(), options.frame.translation());
  const bool stays = options.frame.matrix() == Eigen::Matrix4d::Identity();
  anatomy = stays ? body.anatomy : meshing::compute_anatomy(mesh, body.anatomy.side);
  prone = {"prone", options.frame.rotation() * Eigen::Vector3d(0, -1, 0)};
  supine = {"supine", options.frame.rotation() * Eigen::Vector3d(0.2, 0.9, 0.1).normalized()};
  simulation::Chain chain(mesh, anatomy, options.truth, {prone, supine});
  solution = chain.solve(options.truth);
  const calibration::ModelSkin skin(mesh, solution.poses[0].x);
  measurement.reset(new calibration::Measurement{supine, calibration::Scan(scan_of(skin, options), skin),
                                                 options.noise_mm > 0 ? options.noise_mm : 0.7});
}

simulation::Model twin_truth() {
  simulation::Model model = soft_model();
  model.breast.young_modulus_kpa = {0.9, true, {}, 0.1, 10};
  model.skin.young_modulus_kpa = {25, true, {}, 1, 300};
  return model;
}

simulation::Model twin_start() {
  simulation::Model model = twin_truth();
  model.breast.young_modulus_kpa.value = 0.7;
  model.skin.young_modulus_kpa.value = 40;
  return model;
}

}  // namespace supine::testing
