// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/decimate/sharp_patches.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace supine::meshing {
namespace {

using Edge = std::pair<int, int>;

Edge edge_of(const Triangles& triangles, int t, int k) {
  return std::minmax(int(triangles(t, k)), int(triangles(t, (k + 1) % 3)));
}

std::map<Edge, std::vector<int>> triangles_of_edges(const Triangles& triangles) {
  std::map<Edge, std::vector<int>> edges;
  for (int t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) edges[edge_of(triangles, t, k)].push_back(t);
  return edges;
}

Eigen::Vector3d normal_of(const reconstruction::Surface& surface, int t) {
  const Eigen::Vector3d a = surface.points.row(surface.triangles(t, 0)),
                        b = surface.points.row(surface.triangles(t, 1)),
                        c = surface.points.row(surface.triangles(t, 2));
  return (b - a).cross(c - a).normalized();
}

}  // namespace

SharpPatches sharp_patches(const reconstruction::Surface& surface, double sharp_deg) {
  const auto edges = triangles_of_edges(surface.triangles);
  const double least_cosine = std::cos(sharp_deg * std::numbers::pi / 180);
  const auto region = [&surface](int t) { return surface.region.size() > 0 ? surface.region[t] : 0; };
  SharpPatches patches;
  patches.patch = Eigen::VectorXi::Constant(surface.triangles.rows(), -1);
  std::vector<int> open;
  for (int first = 0; first < surface.triangles.rows(); ++first) {
    if (patches.patch[first] >= 0) continue;
    const int patch = static_cast<int>(patches.region.size());
    patches.region.push_back(region(first));
    patches.patch[first] = patch;
    open = {first};
    while (!open.empty()) {
      const int t = open.back();
      open.pop_back();
      for (int k = 0; k < 3; ++k)
        for (const int other : edges.at(edge_of(surface.triangles, t, k))) {
          if (patches.patch[other] >= 0 || region(other) != region(t)) continue;
          if (normal_of(surface, t).dot(normal_of(surface, other)) < least_cosine) continue;
          patches.patch[other] = patch;
          open.push_back(other);
        }
    }
  }
  return patches;
}

}  // namespace supine::meshing
