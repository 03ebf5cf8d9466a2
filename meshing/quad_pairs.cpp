// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quad_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

#include "reconstruction/mesh_edges.h"

namespace supine::meshing {
namespace {

using reconstruction::MeshEdge;
using reconstruction::Surface;

constexpr double largest_bend_deg = 60;  // between the two triangles of a quad
constexpr int longest_path = 12;         // pairs that may change for one pair more

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

double angle_deg(const Eigen::Vector3d& at, const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  return degrees(std::atan2((p - at).cross(q - at).norm(), (p - at).dot(q - at)));
}

struct Corners {
  std::array<int, 4> points;  // round the quad; 0 and 2 on the diagonal
};

Corners corners_of(const Surface& surface, int a, int b) {
  const auto has = [&surface](int t, int p) {
    return surface.triangles(t, 0) == p || surface.triangles(t, 1) == p || surface.triangles(t, 2) == p;
  };
  int lone = 0;
  while (has(b, surface.triangles(a, lone))) ++lone;
  const int tip = surface.triangles(a, lone), first = surface.triangles(a, (lone + 1) % 3),
            second = surface.triangles(a, (lone + 2) % 3);
  int other = 0;
  while (has(a, surface.triangles(b, other))) ++other;
  return {{first, surface.triangles(b, other), second, tip}};
}

double deviation_deg(const Surface& surface, int a, int b) {
  const Corners corners = corners_of(surface, a, b);
  double largest = 0;
  for (int c = 0; c < 4; ++c) {
    const auto at = [&](int i) { return Eigen::Vector3d(surface.points.row(corners.points[(c + i) % 4]).transpose()); };
    // Where the diagonal ends the angle is the sum of the two triangles': a quad that folds in is no quad.
    const double angle =
        c % 2 == 0 ? angle_deg(at(0), at(3), at(2)) + angle_deg(at(0), at(2), at(1)) : angle_deg(at(0), at(3), at(1));
    largest = std::max(largest, std::abs(angle - 90));
  }
  return largest;
}

double bend_deg(const Surface& surface, int a, int b) {
  const auto normal = [&surface](int t) {
    const Eigen::Vector3d p = surface.points.row(surface.triangles(t, 0)).transpose();
    return Eigen::Vector3d((surface.points.row(surface.triangles(t, 1)).transpose() - p)
                               .cross(surface.points.row(surface.triangles(t, 2)).transpose() - p));
  };
  const Eigen::Vector3d m = normal(a), n = normal(b);
  return degrees(std::atan2(m.cross(n).norm(), m.dot(n)));
}

struct Pair {
  double deviation;
  int a, b;
};

std::vector<Pair> possible_pairs(const Surface& surface, double largest_deviation_deg) {
  std::vector<Pair> pairs;
  for (const MeshEdge& edge : reconstruction::mesh_edges(surface.triangles)) {
    if (edge.count != 2) continue;
    const int a = edge.triangles[0], b = edge.triangles[1];
    if (surface.region.size() > 0 && surface.region(a) != surface.region(b)) continue;
    const Corners corners = corners_of(surface, a, b);
    if (corners.points[1] == corners.points[3]) continue;
    const double deviation = deviation_deg(surface, a, b);
    if (deviation <= largest_deviation_deg && bend_deg(surface, a, b) <= largest_bend_deg)
      pairs.push_back({deviation, a, b});
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& x, const Pair& y) {
    return std::tie(x.deviation, x.a, x.b) < std::tie(y.deviation, y.a, y.b);
  });
  return pairs;
}

class Matching {
 public:
  Matching(Eigen::Index triangles, const std::vector<Pair>& pairs) : next_(triangles), partner(triangles, -1) {
    for (const Pair& pair : pairs) {
      next_[pair.a].push_back(pair.b);
      next_[pair.b].push_back(pair.a);
      if (partner[pair.a] < 0 && partner[pair.b] < 0) {
        partner[pair.a] = pair.b;
        partner[pair.b] = pair.a;
      }
    }
  }

  // Shortest alternating path from a triangle alone to another, breadth first; pairs along it change over.
  bool augment(int from) {
    std::vector<std::array<int, 3>> queue{{from, -1, 0}};  // triangle, row it came from, pairs so far
    std::vector<int> seen{from};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const auto [t, before, depth] = queue[i];
      for (const int middle : next_[t]) {
        if (std::find(seen.begin(), seen.end(), middle) != seen.end()) continue;
        if (partner[middle] < 0) {
          change_over(queue, static_cast<int>(i), middle);
          return true;
        }
        const int beyond = partner[middle];
        if (depth >= longest_path || std::find(seen.begin(), seen.end(), beyond) != seen.end()) continue;
        seen.push_back(middle);
        seen.push_back(beyond);
        via_.resize(partner.size(), -1);
        via_[beyond] = middle;
        queue.push_back({beyond, static_cast<int>(i), depth + 1});
      }
    }
    return false;
  }

 private:
  void change_over(const std::vector<std::array<int, 3>>& queue, int row, int last) {
    while (row >= 0) {
      const int t = queue[row][0], middle = queue[row][1] >= 0 ? via_[t] : -1;
      partner[t] = last;
      partner[last] = t;
      last = middle;
      row = queue[row][1];
    }
  }

  std::vector<std::vector<int>> next_;
  std::vector<int> via_;

 public:
  std::vector<int> partner;
};

}  // namespace

QuadPairs pair_triangles(const Surface& surface, double largest_deviation_deg) {
  Matching matching(surface.triangles.rows(), possible_pairs(surface, largest_deviation_deg));
  const auto count = static_cast<int>(surface.triangles.rows());
  for (int t = 0; t < count; ++t)
    if (matching.partner[t] < 0) matching.augment(t);
  QuadPairs result{Eigen::VectorXi::Constant(count, -1)};
  for (int t = 0; t < count; ++t) {
    const int other = matching.partner[t];
    if (other < 0) ++result.alone;
    if (other > t) result.quad(t) = result.quad(other) = result.quads++;
  }
  return result;
}

Eigen::VectorXd quad_deviations_deg(const Surface& surface, const QuadPairs& pairs) {
  Eigen::VectorXd result(pairs.quads);
  std::vector<int> first(pairs.quads, -1);
  for (int t = 0; t < pairs.quad.size(); ++t) {
    const int quad = pairs.quad(t);
    if (quad < 0) continue;
    if (first[quad] < 0)
      first[quad] = t;
    else
      result(quad) = deviation_deg(surface, first[quad], t);
  }
  return result;
}

}  // namespace supine::meshing
