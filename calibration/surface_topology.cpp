// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/surface_topology.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace supine::calibration {
namespace {

std::vector<int> weld(const Points& points) {
  const auto before = [&points](int a, int b) {
    for (int k = 0; k < 3; ++k) {
      if (points(a, k) != points(b, k)) return points(a, k) < points(b, k);
    }
    return a < b;
  };
  std::vector<int> order(points.rows());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), before);
  std::vector<int> vertex(points.rows());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && points.row(order[i]) == points.row(order[i - 1]);
    vertex[order[i]] = same ? vertex[order[i - 1]] : order[i];
  }
  return vertex;
}

std::span<const int> slice(const std::vector<int>& begin, const std::vector<int>& values, int i) {
  return {values.data() + begin[i], values.data() + begin[i + 1]};
}

bool pinched(const Triangles& vertex, int t) {
  return vertex(t, 0) == vertex(t, 1) || vertex(t, 1) == vertex(t, 2) || vertex(t, 2) == vertex(t, 0);
}

// Whether triangle t runs through the edge from vertex a to vertex b in this sense.
bool runs(const Triangles& vertex, int t, int a, int b) {
  for (int k = 0; k < 3; ++k) {
    if (vertex(t, k) == a && vertex(t, (k + 1) % 3) == b) return true;
  }
  return false;
}

}  // namespace

SurfaceTopology::SurfaceTopology(const Points& points, const Triangles& triangles)
    : vertex_(triangles.rows(), 3), vertex_of_point_(weld(points)) {
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    for (int k = 0; k < 3; ++k) vertex_(t, k) = vertex_of_point_[triangles(t, k)];
  }
  build_edges();
  build_stars(points.rows());
}

void SurfaceTopology::build_edges() {
  struct Half {
    int low, high, triangle, corner;
  };
  std::vector<Half> halves;
  for (int t = 0; t < vertex_.rows(); ++t) {
    if (pinched(vertex_, t)) continue;  // has a corner twice: it separates nothing and joins nothing
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({vertex_(t, k), vertex_(t, (k + 1) % 3)});
      halves.push_back({low, high, t, k});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) {
    return std::tie(a.low, a.high, a.triangle, a.corner) < std::tie(b.low, b.high, b.triangle, b.corner);
  });
  edge_.assign(vertex_.rows(), {-1, -1, -1});
  int edge = -1;
  for (std::size_t i = 0; i < halves.size(); ++i) {
    const bool first = i == 0 || halves[i].low != halves[i - 1].low || halves[i].high != halves[i - 1].high;
    if (first) {
      edge_begin_.push_back(static_cast<int>(i));
      ++edge;
    }
    edge_[halves[i].triangle][halves[i].corner] = edge;
    edge_triangles_.push_back(halves[i].triangle);
  }
  edge_begin_.push_back(static_cast<int>(halves.size()));
}

void SurfaceTopology::build_stars(Eigen::Index point_count) {
  star_begin_.assign(point_count + 1, 0);
  border_vertex_.assign(point_count, false);
  for (int t = 0; t < vertex_.rows(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ++star_begin_[vertex_(t, k) + 1];
      if (border_edge(t, k)) border_vertex_[vertex_(t, k)] = border_vertex_[vertex_(t, (k + 1) % 3)] = true;
    }
  }
  std::partial_sum(star_begin_.begin(), star_begin_.end(), star_begin_.begin());
  star_triangles_.resize(star_begin_.back());
  std::vector<int> next(star_begin_.begin(), star_begin_.end() - 1);
  for (int t = 0; t < vertex_.rows(); ++t) {
    for (int k = 0; k < 3; ++k) star_triangles_[next[vertex_(t, k)]++] = t;
  }
}

std::span<const int> SurfaceTopology::around_edge(int triangle, int corner) const {
  if (edge_[triangle][corner] < 0) return {};
  return slice(edge_begin_, edge_triangles_, edge_[triangle][corner]);
}

std::span<const int> SurfaceTopology::around_vertex(int triangle, int corner) const {
  return slice(star_begin_, star_triangles_, vertex_(triangle, corner));
}

std::vector<int> orient_pieces(const SurfaceTopology& topology, Triangles& triangles) {
  const Triangles& vertex = topology.vertex();
  const int count = static_cast<int>(vertex.rows());
  std::vector<int> piece(count, -1);
  std::vector<bool> turned(count, false);
  std::vector<int> open;
  int pieces = 0;
  for (int seed = 0; seed < count; ++seed) {
    if (piece[seed] >= 0) continue;
    piece[seed] = pieces++;
    open.push_back(seed);
    while (!open.empty()) {
      const int t = open.back();
      open.pop_back();
      for (int k = 0; k < 3; ++k) {
        const auto around = topology.around_edge(t, k);
        if (around.size() != 2) continue;
        const int other = around[0] == t ? around[1] : around[0];
        if (piece[other] >= 0) continue;
        const bool agree = runs(vertex, other, vertex(t, (k + 1) % 3), vertex(t, k));
        turned[other] = agree ? turned[t] : !turned[t];
        piece[other] = piece[t];
        open.push_back(other);
      }
    }
  }
  for (int t = 0; t < count; ++t) {
    if (turned[t]) std::swap(triangles(t, 1), triangles(t, 2));
  }
  return piece;
}

}  // namespace supine::calibration
