// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/surface/crossings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;
using Vector = Eigen::Vector3d;
using Corners = std::array<Vector, 3>;

// Far above what rounding does to the sums of products below (some 1e-15 of the sum of their absolute values).
constexpr double rounding = 1e-13;
constexpr double underflow = 1e-250;

/// A sum of products of coordinates' differences with a bound of its rounding. A direction that was computed is taken
/// as it is: any direction that separates two triangles proves that they are apart.
struct Bounded {
  double value, error;
  bool positive() const { return value > error; }
  bool negative() const { return value < -error; }
};

Bounded along(const Vector& direction, const Vector& difference) {
  return {direction.dot(difference), rounding * direction.cwiseAbs().dot(difference.cwiseAbs()) + underflow};
}

// det (a, b, c)
Bounded determinant(const Vector& a, const Vector& b, const Vector& c) {
  const Vector size(std::abs(b.y() * c.z()) + std::abs(b.z() * c.y()),
                    std::abs(b.z() * c.x()) + std::abs(b.x() * c.z()),
                    std::abs(b.x() * c.y()) + std::abs(b.y() * c.x()));
  return {a.dot(b.cross(c)), rounding * a.cwiseAbs().dot(size) + underflow};
}

bool same_sign(const Bounded& x, const Bounded& y) {
  return (x.positive() && y.positive()) || (x.negative() && y.negative());
}

// An edge pq in common, p first: apart when the other corners lie on two sides of it, or not in one plane with it.
bool apart_at_edge(const Vector& edge, const Vector& a, const Vector& b) {
  const double dot = edge.cross(a).dot(edge.cross(b));
  const double bound = rounding * edge.squaredNorm() * std::sqrt(a.squaredNorm() * b.squaredNorm()) + underflow;
  if (dot < -bound) return true;
  const Bounded volume = determinant(edge, a, b);
  return volume.positive() || volume.negative();
}

bool separates(const Vector& direction, const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  const Bounded at_a = along(direction, a), at_b = along(direction, b), at_c = along(direction, c),
                at_d = along(direction, d);
  return (at_a.positive() && at_b.positive() && at_c.negative() && at_d.negative()) ||
         (at_a.negative() && at_b.negative() && at_c.positive() && at_d.positive());
}

// A corner in common, from which a, b and c, d lead to the others: apart when a plane through it separates them, or
// when the plane of one leaves the other on one side. Tried are the plane across the way from one to the other, then,
// as both lie nearly in one plane, those across it through the middle of a gap between an edge of each.
bool apart_at_corner(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  if (separates(a + b - c - d, a, b, c, d)) return true;
  if (same_sign(determinant(a, b, c), determinant(a, b, d)) || same_sign(determinant(c, d, a), determinant(c, d, b)))
    return true;
  const Vector one = a.cross(b), two = c.cross(d), across = one.dot(two) < 0 ? Vector(one - two) : Vector(one + two);
  for (const Vector& own : {a, b})
    for (const Vector& other : {c, d})
      if (separates(across.cross(own * other.norm() + other * own.norm()), a, b, c, d)) return true;
  return false;
}

// Nothing in common: apart when some plane across the direction lies between them.
bool separates(const Vector& direction, const Corners& s, const Corners& t) {
  double low_s = 1e300, high_s = -1e300, low_t = 1e300, high_t = -1e300;
  for (int c = 0; c < 3; ++c) {
    const Bounded on_s = along(direction, s[c] - s[0]), on_t = along(direction, t[c] - s[0]);
    if (!std::isfinite(on_s.value + on_s.error + on_t.value + on_t.error)) return false;  // overflow: undecided
    low_s = std::min(low_s, on_s.value - on_s.error);
    high_s = std::max(high_s, on_s.value + on_s.error);
    low_t = std::min(low_t, on_t.value - on_t.error);
    high_t = std::max(high_t, on_t.value + on_t.error);
  }
  return high_s < low_t || high_t < low_s;
}

bool apart(const Corners& s, const Corners& t) {
  return separates(s[0] + s[1] + s[2] - t[0] - t[1] - t[2], s, t) ||
         separates((s[1] - s[0]).cross(s[2] - s[0]), s, t) || separates((t[1] - t[0]).cross(t[2] - t[0]), s, t);
}

// Whether the two are surely apart but for what they share; no where rounding could decide.
bool surely_apart(const Surface& surface, int s, int t) {
  const auto at = [&surface](int p) { return Vector(surface.points.row(p).transpose()); };
  std::array<int, 3> own, other;  // shared points first, in the same order
  int shared = 0, lone = 2;
  bool common[3] = {false, false, false};  // by corner of t
  for (int i = 0; i < 3; ++i) {
    const int p = surface.triangles(s, i);
    int j = 0;
    while (j < 3 && surface.triangles(t, j) != p) ++j;
    if (j < 3) {
      common[j] = true;
      own[shared] = other[shared] = p;
      ++shared;
    } else {
      own[lone--] = p;
    }
  }
  if (shared == 3) return false;
  for (int j = 0, next = 2; j < 3; ++j)
    if (!common[j]) other[next--] = surface.triangles(t, j);
  if (shared == 0) return apart({at(own[0]), at(own[1]), at(own[2])}, {at(other[0]), at(other[1]), at(other[2])});
  const Vector p = at(own[0]), a = at(own[1]) - p, b = at(own[2]) - p, d = at(other[2]) - p;
  return shared == 2 ? apart_at_edge(a, b, d) : apart_at_corner(a, b, at(other[1]) - p, d);
}

Surface part_of(const Surface& surface, const std::vector<int>& triangles) {
  Surface part;
  std::vector<int> points;
  for (const int t : triangles)
    for (int c = 0; c < 3; ++c) points.push_back(surface.triangles(t, c));
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  part.points = surface.points(points, Eigen::all);
  part.triangles = surface.triangles(triangles, Eigen::all);
  for (Eigen::Index i = 0; i < part.triangles.size(); ++i) {
    int& p = part.triangles.data()[i];
    p = static_cast<int>(std::lower_bound(points.begin(), points.end(), p) - points.begin());
  }
  return part;
}

}  // namespace

std::vector<std::pair<int, int>> crossings(const Surface& surface, const TriangleTree& tree) {
  std::vector<int> left;  // triangles of the pairs that are not cleared
  for (const auto& [s, t] : tree.pairs([&surface](int s, int t) { return !surely_apart(surface, s, t); })) {
    left.push_back(s);
    left.push_back(t);
  }
  if (left.empty()) return {};
  std::sort(left.begin(), left.end());
  left.erase(std::unique(left.begin(), left.end()), left.end());
  std::vector<std::pair<int, int>> result = reconstruction::self_intersections(part_of(surface, left));
  for (auto& [s, t] : result) {
    s = left[s];
    t = left[t];
  }
  return result;
}

}  // namespace supine::meshing
