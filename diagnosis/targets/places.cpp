// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/places.h"

#include <Eigen/LU>
#include <optional>
#include <utility>

#include "simulation/embedding.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// Where the line from @p from along @p way leaves the skin last.
std::optional<std::pair<Index, Vector3d>> last_crossing(const calibration::SurfaceDistance& skin, const Vector3d& from,
                                                        const Vector3d& way) {
  std::optional<std::pair<Index, Vector3d>> found;
  double furthest = 0;
  for (Index t = 0; t < skin.triangles().rows(); ++t) {
    const Vector3d a = skin.points().row(skin.triangles()(t, 0)), b = skin.points().row(skin.triangles()(t, 1)),
                   c = skin.points().row(skin.triangles()(t, 2));
    Eigen::Matrix3d system;
    system << b - a, c - a, -way;
    const Vector3d s = system.fullPivLu().solve(from - a);
    if (!s.allFinite() || s[0] < -1e-9 || s[1] < -1e-9 || s[0] + s[1] > 1 + 1e-9 || s[2] <= furthest) continue;
    furthest = s[2];
    found = {t, Vector3d(1 - s[0] - s[1], s[0], s[1])};
  }
  return found;
}

}  // namespace

Places places_of(const meshing::TetMesh& mesh, const Points& imaged, const Points& x, const Vector3d& up) {
  const Index count = imaged.rows();
  const calibration::ModelSkin skin(mesh, x);
  const auto& surface = skin.distance();
  Places places{Points(3 * count, 3), Points(3 * count, 3), {}, {}, {}};
  const Points there = simulation::Embedding(mesh, imaged).at(x);
  calibration::ClosestPoints closest;
  skin.closest(there, closest);
  for (Index p = 0; p < count; ++p) {
    const auto set = [&](Index row, const auto& nodes, const auto& weight) {
      places.imaged.row(row).setZero(), places.there.row(row).setZero();
      for (Index a = 0; a < weight.size(); ++a) {
        places.imaged.row(row) += weight[a] * mesh.points.row(nodes[a]);
        places.there.row(row) += weight[a] * x.row(nodes[a]);
      }
    };
    places.imaged.row(p) = imaged.row(p), places.there.row(p) = there.row(p);
    set(count + p, closest.node.row(p), closest.weight.row(p));
    places.normal.push_back(closest.normal.row(p).transpose());
    const auto over = last_crossing(surface, there.row(p).transpose(), up);
    places.has_straight.push_back(over.has_value());
    if (!over) {
      set(2 * count + p, closest.node.row(p), closest.weight.row(p));
      places.straight_normal.push_back(places.normal.back());
      continue;
    }
    const auto nodes = surface.triangles().row(over->first);
    set(2 * count + p, nodes, over->second);
    const Vector3d a = x.row(nodes[0]), b = x.row(nodes[1]), c = x.row(nodes[2]);
    places.straight_normal.push_back((b - a).cross(c - a).normalized());
  }
  return places;
}

}  // namespace supine::diagnosis
