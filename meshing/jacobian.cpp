// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/jacobian.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

#include "meshing/topology.h"

namespace supine::meshing {
namespace {

constexpr int most_pieces = 20000;  // the bounds close quadratically: a few dozen are usual

// ∂x/∂ξ is linear in the barycentric coordinates: its values at four points give it on the tetrahedron between them.
using Jacobians = std::array<Eigen::Matrix3d, 4>;

Jacobians corner_jacobians(const QuadraticNodes& x) {
  // Row and column: the node between two corners.
  constexpr int between[4][4] = {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3}};
  Jacobians jacobians;
  for (int c = 0; c < 4; ++c) {
    const auto by_barycentric = [&](int k) -> Eigen::Vector3d {
      if (k == c) return 3 * x.row(c).transpose();
      return (4 * x.row(between[c][k]) - x.row(k)).transpose();
    };
    for (int k = 0; k < 3; ++k) jacobians[c].col(k) = by_barycentric(k + 1) - by_barycentric(0);
  }
  return jacobians;
}

double det(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b, const Eigen::Matrix3d& c) {
  return a.col(0).cross(b.col(1)).dot(c.col(2));
}

// The symmetric trilinear form with polar(a, a, a) = det a.
double polar(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b, const Eigen::Matrix3d& c) {
  return (det(a, b, c) + det(b, c, a) + det(c, a, b) + det(a, c, b) + det(c, b, a) + det(b, a, c)) / 6;
}

double polar(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return (det(a, a, b) + det(a, b, a) + det(b, a, a)) / 3;
}

std::array<double, 20> coefficients(const Jacobians& j) {
  std::array<double, 20> out;
  int n = 0;
  for (int a = 0; a < 4; ++a) out[n++] = j[a].determinant();
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b)
      if (a != b) out[n++] = polar(j[a], j[b]);
  for (int a = 0; a < 4; ++a) out[n++] = polar(j[(a + 1) % 4], j[(a + 2) % 4], j[(a + 3) % 4]);
  return out;
}

// A tetrahedron within the reference one; the longest edge in barycentric terms is halved next.
struct Piece {
  std::array<Eigen::Vector4d, 4> place;
  Jacobians jacobian;
  double low = 0, high = 0;
};

Piece measured(Piece piece) {
  const auto c = coefficients(piece.jacobian);
  piece.low = *std::min_element(c.begin(), c.end());
  piece.high = *std::min_element(c.begin(), c.begin() + 4);
  return piece;
}

std::array<Piece, 2> halves(const Piece& piece) {
  int from = 0, to = 1;
  double longest = -1;
  for (const auto& [a, b] : tet_edges) {
    const double length = (piece.place[a] - piece.place[b]).squaredNorm();
    if (length > longest) {
      longest = length;
      from = a;
      to = b;
    }
  }
  std::array<Piece, 2> out = {piece, piece};
  out[0].place[to] = out[1].place[from] = (piece.place[from] + piece.place[to]) / 2;
  out[0].jacobian[to] = out[1].jacobian[from] = (piece.jacobian[from] + piece.jacobian[to]) / 2;
  return {measured(out[0]), measured(out[1])};
}

// Bounds of the smallest determinant, closed until @p enough says so.
template <class Enough>
ScaledJacobian close_in(const QuadraticNodes& nodes, const Enough& enough) {
  Eigen::Matrix3d straight;
  for (int k = 0; k < 3; ++k) straight.col(k) = (nodes.row(k + 1) - nodes.row(0)).transpose();
  const double scale = straight.determinant();
  Piece whole;
  for (int k = 0; k < 4; ++k) whole.place[k] = Eigen::Vector4d::Unit(k);
  whole.jacobian = corner_jacobians(nodes);
  const auto higher = [](const Piece& a, const Piece& b) { return a.low > b.low; };
  std::priority_queue<Piece, std::vector<Piece>, decltype(higher)> pieces(higher);
  pieces.push(measured(whole));
  double high = pieces.top().high;
  for (int n = 0;; ++n) {
    const ScaledJacobian bounds{pieces.top().low / scale, high / scale};
    if (n == most_pieces || enough(bounds)) return bounds;
    const Piece lowest = pieces.top();
    pieces.pop();
    for (Piece& half : halves(lowest)) {
      high = std::min(high, half.high);
      pieces.push(std::move(half));
    }
  }
}

}  // namespace

QuadraticNodes quadratic_nodes(const TetMesh& mesh, Eigen::Index c) {
  QuadraticNodes nodes;
  for (int k = 0; k < 10; ++k) nodes.row(k) = mesh.points.row(mesh.cells(c, k));
  return nodes;
}

std::array<double, 20> jacobian_coefficients(const QuadraticNodes& nodes) {
  return coefficients(corner_jacobians(nodes));
}

ScaledJacobian smallest_scaled_jacobian(const QuadraticNodes& nodes, double tolerance) {
  return close_in(nodes, [tolerance](const ScaledJacobian& b) { return b.high - b.low <= tolerance; });
}

bool scaled_jacobian_exceeds(const QuadraticNodes& nodes, double bound) {
  const ScaledJacobian found =
      close_in(nodes, [bound](const ScaledJacobian& b) { return b.low > bound || b.high <= bound; });
  return found.low > bound;
}

double curved_volume_mm3(const QuadraticNodes& nodes) {
  // Every Bernstein polynomial of degree 3 has the integral 1/20 of the tetrahedron's volume 1/6.
  double sum = 0;
  for (const double c : jacobian_coefficients(nodes)) sum += c;
  return sum / 120;
}

double curved_area_mm2(const Points& points, const Indices& faces, Eigen::Index f) {
  // Dunavant 1985, degree 4: two orbits (a, a, 1 - 2a), weights sum to 1/2.
  constexpr double place[2] = {0.445948490915965, 0.091576213509771};
  constexpr double weight[2] = {0.111690794839005, 0.054975871827661};
  Eigen::Matrix<double, 6, 3> x;
  for (int k = 0; k < 6; ++k) x.row(k) = points.row(faces(f, k));
  double area = 0;
  for (int orbit = 0; orbit < 2; ++orbit) {
    for (int turn = 0; turn < 3; ++turn) {
      Eigen::Vector3d l = Eigen::Vector3d::Constant(place[orbit]);
      l[turn] = 1 - 2 * place[orbit];
      const auto along = [&](int k) -> Eigen::RowVector3d {  // ∂x/∂l_k; middles 3 (01), 4 (12), 5 (20)
        const int next = (k + 1) % 3, before = (k + 2) % 3;
        return (4 * l[k] - 1) * x.row(k) + 4 * l[next] * x.row(3 + k) + 4 * l[before] * x.row(3 + before);
      };
      const Eigen::RowVector3d u = along(1) - along(0), v = along(2) - along(0);
      area += weight[orbit] * u.cross(v).norm();
    }
  }
  return area;
}

}  // namespace supine::meshing
