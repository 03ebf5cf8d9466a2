// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/motion.h"

#include <cmath>
#include <numbers>

#include "meshing/surface/triangle_tree.h"
#include "phantom/face_grid.h"
#include "phantom/random.h"
#include "reconstruction/surface.h"
#include "simulation/embedding.h"

namespace supine::phantom {
namespace {

constexpr int places = 20;
constexpr int steps = 3;  // a face is cut into steps² triangles

/// A place on the foot, and how far up from muscle to skin: even over the mound's volume.
Eigen::Vector3d place_in_mound(const Body& body, Random& random) {
  for (;;) {
    const double foot_radii = std::sqrt(random.uniform()), azimuth = random.uniform(0, 2 * std::numbers::pi);
    const double share = random.uniform();
    const Eigen::Vector2d disc(foot_radii / body.reach * std::cos(azimuth),
                               foot_radii / body.reach * std::sin(azimuth));
    if (random.uniform() * body.height_mm < body.thickness_mm(foot_radii)) return body.place(disc, share);
  }
}

/// Row 0 the nipple, then the places, then the tumour; stress-free, LPS mm.
Points marked_points(const Body& body, std::uint64_t seed) {
  Random random(seed, "motion");
  Points points(2 + places, 3);
  points.row(0) = body.world(body.place(Eigen::Vector2d::Zero(), 1)).transpose();
  for (int i = 1; i <= places; ++i) points.row(i) = body.world(place_in_mound(body, random)).transpose();
  points.row(1 + places) = body.world(body.tumour_centre).transpose();
  return points;
}

}  // namespace

Motion measure_motion(const BodyMesh& body_mesh, const Body& body, const Points& prone, const Points& supine,
                      std::uint64_t seed) {
  const simulation::Embedding embedding(body_mesh.mesh, marked_points(body, seed));
  const Points marks[] = {embedding.at(prone), embedding.at(supine)};
  const Points moved = marks[1] - marks[0];
  const FaceGrid skin(body_mesh.mesh, faces_with(body_mesh.mesh, static_cast<int>(reconstruction::Region::skin)),
                      steps);
  const meshing::TriangleTree trees[] = {{skin.at(prone), skin.triangles()}, {skin.at(supine), skin.triangles()}};
  Motion motion;
  const double outer = body.side == "left" ? 1 : -1;
  motion.nipple_mm = moved.row(0).transpose().cwiseProduct(Eigen::Vector3d(outer, 1, 1));
  for (Eigen::Index i = 1; i <= places; ++i) {
    InnerPlace place{moved.row(i).norm(), (moved.row(i) - moved.row(0)).norm(), {}, {}};
    for (int pose = 0; pose < 2; ++pose) {
      const Eigen::Vector3d at = marks[pose].row(i).transpose();
      place.muscle_mm[pose] = body_mesh.anatomy.muscle->value(at);
      place.skin_mm[pose] = std::sqrt(trees[pose].closest(at).squared_mm2);
    }
    motion.inside.push_back(place);
  }
  motion.prone = marks[0].bottomRows(1 + places), motion.supine = marks[1].bottomRows(1 + places);
  return motion;
}

}  // namespace supine::phantom
