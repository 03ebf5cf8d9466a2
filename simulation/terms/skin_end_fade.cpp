// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_end_fade.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "common/error.h"
#include "reconstruction/surface.h"
#include "simulation/elements/elements.h"
#include "simulation/terms/skin.h"

namespace supine::simulation {
namespace {

using Place = Eigen::RowVector3d;
using Segment = std::pair<Place, Place>;

/// Edges that a skin face shares with a face of another region, curved ones as two straight halves.
std::vector<Segment> skin_end(const meshing::TetMesh& mesh) {
  struct Sides {
    bool skin = false, other = false;
    int middle = -1;
  };
  std::map<std::pair<int, int>, Sides> edges;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      Sides& sides = edges[std::minmax(mesh.faces(f, k), mesh.faces(f, (k + 1) % 3))];
      (mesh.region[f] == static_cast<int>(reconstruction::Region::skin) ? sides.skin : sides.other) = true;
      if (mesh.faces.cols() == 6) sides.middle = mesh.faces(f, 3 + k);
    }
  std::vector<Segment> end;
  for (const auto& [corners, sides] : edges) {
    if (!sides.skin || !sides.other) continue;
    const Place a = mesh.points.row(corners.first), b = mesh.points.row(corners.second);
    if (sides.middle < 0) {
      end.emplace_back(a, b);
      continue;
    }
    const Place middle = mesh.points.row(sides.middle);
    end.emplace_back(a, middle);
    end.emplace_back(middle, b);
  }
  return end;
}

double distance_mm(const Place& from, const Segment& to) {
  const Place along = to.second - to.first, way = from - to.first;
  const double t = std::clamp(way.dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (way - t * along).norm();
}

}  // namespace

template <class Face>
Eigen::VectorXd fade_from_skin_end(const meshing::TetMesh& mesh, const Eigen::VectorXi& faces, double length_mm) {
  if (!(length_mm > 0)) return {};
  const std::vector<Segment> end = skin_end(mesh);
  if (end.empty())
    throw InputError(
        fmt::format("skin.fade_mm is {:g}, but the skin of this mesh ends nowhere; leave it out", length_mm));
  Eigen::VectorXd share(faces.size() * Face::points);
  for (Eigen::Index f = 0; f < faces.size(); ++f) {
    const NodeRows<Face::nodes> nodes = gather<Face::nodes>(mesh.points, mesh.faces, faces[f]);
    for (int p = 0; p < Face::points; ++p) {
      const Place at = Face::table().value[static_cast<std::size_t>(p)].transpose() * nodes;
      double nearest = length_mm;
      for (const Segment& segment : end) nearest = std::min(nearest, distance_mm(at, segment));
      const double t = nearest / length_mm;
      share[f * Face::points + p] = t * t * (3 - 2 * t);
    }
  }
  return share;
}

template Eigen::VectorXd fade_from_skin_end<Tri3Centroid>(const meshing::TetMesh&, const Eigen::VectorXi&, double);
template Eigen::VectorXd fade_from_skin_end<Tri3>(const meshing::TetMesh&, const Eigen::VectorXi&, double);
template Eigen::VectorXd fade_from_skin_end<Tri6>(const meshing::TetMesh&, const Eigen::VectorXi&, double);

}  // namespace supine::simulation
