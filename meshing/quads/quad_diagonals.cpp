// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/quad_diagonals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "reconstruction/mesh_edges.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;

// A diagonal that lies a hundredth of its length nearer to the input is worth that many degrees of smallest angle.
constexpr double degrees_per_hundredth = 2;
constexpr double least_gain_deg = 1;  // equals stay, so that rounding decides nothing
constexpr double largest_fold_cosine = 0.2;

// Quad p0 p1 p2 p3, counter-clockwise, cut from p0 to p2.
struct Quad {
  int first = -1, second = -1;  // its triangles
  std::array<int, 4> points{};
};

std::vector<Quad> quads_of(const Surface& surface, const QuadPairs& pairs) {
  std::vector<Quad> quads(pairs.quads);
  for (int t = 0; t < pairs.quad.size(); ++t)
    if (const int q = pairs.quad(t); q >= 0) (quads[q].first < 0 ? quads[q].first : quads[q].second) = t;
  for (Quad& quad : quads) {
    const auto s = surface.triangles.row(quad.first), t = surface.triangles.row(quad.second);
    const auto shared = [&](int p) { return t(0) == p || t(1) == p || t(2) == p; };
    int lone = 0;
    while (shared(s(lone))) ++lone;
    const int from = s((lone + 1) % 3), to = s((lone + 2) % 3);
    quad.points = {to, s(lone), from, t(0) + t(1) + t(2) - from - to};
  }
  return quads;
}

class Diagonals {
 public:
  Diagonals(const TriangleTree& input, Surface& surface) : input_(input), surface_(surface) {
    for (const reconstruction::MeshEdge& edge : reconstruction::mesh_edges(surface.triangles))
      edges_.insert({edge.points[0], edge.points[1]});
  }

  bool turn_if_better(const Quad& quad) {
    const auto [a, b, c, d] = quad.points;
    if (edges_.count(std::minmax(b, d))) return false;
    const Eigen::Vector3d one = normal(a, b, c), two = normal(a, c, d), first = normal(b, c, d),
                          second = normal(b, d, a);
    const Eigen::Vector3d mean = one + two;
    if (first.dot(mean) <= 0 || second.dot(mean) <= 0) return false;
    if (first.normalized().dot(second.normalized()) < largest_fold_cosine) return false;
    if (score(b, d, a, c) < score(a, c, b, d) + least_gain_deg) return false;
    edges_.erase(std::minmax(a, c));
    edges_.insert(std::minmax(b, d));
    surface_.triangles.row(quad.first) << b, c, d;
    surface_.triangles.row(quad.second) << b, d, a;
    return true;
  }

 private:
  Eigen::Vector3d at(int p) const { return surface_.points.row(p).transpose(); }
  Eigen::Vector3d normal(int a, int b, int c) const { return (at(b) - at(a)).cross(at(c) - at(a)); }

  double angle_deg(int p, int q, int r) const {
    const Eigen::Vector3d u = at(q) - at(p), v = at(r) - at(p);
    return std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi;
  }
  double smallest_angle_deg(int a, int b, int c) const {
    return std::min({angle_deg(a, b, c), angle_deg(b, c, a), angle_deg(c, a, b)});
  }

  // Of the diagonal from a to c with the other corners b and d.
  double score(int a, int c, int b, int d) const {
    const double away_mm = std::sqrt(input_.closest(Eigen::Vector3d(0.5 * (at(a) + at(c)))).squared_mm2);
    return std::min(smallest_angle_deg(a, b, c), smallest_angle_deg(a, c, d)) -
           degrees_per_hundredth * 100 * away_mm / (at(a) - at(c)).norm();
  }

  const TriangleTree& input_;
  Surface& surface_;
  std::set<std::pair<int, int>> edges_;
};

}  // namespace

int choose_diagonals(const TriangleTree& input, const QuadPairs& pairs, Surface& surface) {
  Diagonals diagonals(input, surface);
  int turned = 0;
  for (const Quad& quad : quads_of(surface, pairs)) turned += diagonals.turn_if_better(quad) ? 1 : 0;
  return turned;
}

}  // namespace supine::meshing
