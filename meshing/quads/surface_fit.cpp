// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/surface_fit.h"

#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "reconstruction/mesh_edges.h"

namespace supine::meshing {
namespace {

using reconstruction::MeshEdge;
using reconstruction::Surface;

constexpr double along_surface = 0.02;  // weight of sample distances in the tangent plane
constexpr double corner_weight = 100;   // of corners, in vertex areas
constexpr double border_weight = 2;     // of the borders, in vertex areas
constexpr double anchor = 0.005;        // of the points to where they are, in vertex areas
constexpr int most_halvings = 6;
constexpr double largest_emphasis = 50;

bool is_border(const Surface& surface, const MeshEdge& edge) {
  return edge.count == 1 ||
         (surface.region.size() > 0 && surface.region(edge.triangles[0]) != surface.region(edge.triangles[1]));
}

// An edge is a triangle with two corners at once, which closest points do not mind.
Triangles as_triangles(const std::vector<std::array<int, 2>>& chains) {
  Triangles segments(static_cast<Eigen::Index>(chains.size()), 3);
  for (std::size_t e = 0; e < chains.size(); ++e)
    segments.row(static_cast<Eigen::Index>(e)) << chains[e][0], chains[e][1], chains[e][1];
  return segments;
}

std::vector<char> border_points_of(const Surface& surface, const std::vector<MeshEdge>& edges) {
  std::vector<char> result(surface.points.rows(), 0);
  for (const MeshEdge& edge : edges)
    if (is_border(surface, edge)) result[edge.points[0]] = result[edge.points[1]] = 1;
  return result;
}

// Normal equations over points with 3 unknowns each, entry by entry.
class Equations {
 public:
  explicit Equations(Eigen::Index points) : right_(Eigen::VectorXd::Zero(3 * points)) {}

  void add_block(int p, int q, const Eigen::Matrix3d& block) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) entries_.emplace_back(3 * p + i, 3 * q + j, block(i, j));
  }
  void add_right(int p, const Eigen::Vector3d& value) { right_.segment<3>(3 * p) += value; }

  // |metric^(1/2) (sum of weights × points − wanted)|²
  void add(const std::vector<std::pair<int, double>>& terms, const Eigen::Matrix3d& metric,
           const Eigen::Vector3d& wanted) {
    for (const auto& [p, a] : terms) {
      for (const auto& [q, b] : terms) add_block(p, q, a * b * metric);
      add_right(p, a * (metric * wanted));
    }
  }

  // Conjugate gradients from @p start: the next round matches anew anyway, so a thousandth of the way left is enough.
  Points solve(const Points& start) const {
    using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
    Matrix matrix(right_.size(), right_.size());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::Map<const Eigen::VectorXd> x(start.data(), start.size());
    Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> gradients;
    gradients.setTolerance(1e-3);
    gradients.compute(matrix);
    const Eigen::VectorXd moved = x + gradients.solve(right_ - matrix * x);
    return Eigen::Map<const Points>(moved.data(), moved.size() / 3, 3);
  }

 private:
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd right_;
};

class Fit {
 public:
  Fit(const FitTarget& target, const QuadPairs& pairs, const FitOptions& options, FieldMesh& coarse,
      std::vector<int>& nearest)
      : target_(target),
        pairs_(pairs),
        options_(options),
        coarse_(coarse),
        points_(coarse.surface.points),
        nearest_(nearest) {
    edges_ = reconstruction::mesh_edges(coarse.surface.triangles);
    collect_neighbours();
  }

  void run() {
    for (int round = 0; round < options_.rounds; ++round) {
      Equations equations(points_.rows());
      add_samples(equations);
      add_borders(equations);
      add_smoothing(equations);
      add_squares(equations);
      // Holds what neither samples nor neighbours hold, for example a point whose triangles no sample is nearest to.
      for (int p = 0; p < points_.rows(); ++p)
        equations.add({{p, 1}}, anchor * area(p) * Eigen::Matrix3d::Identity(), points_.row(p).transpose());
      step(equations.solve(points_));
    }
  }

 private:
  double area(int p) const { return coarse_.size_mm(p) * coarse_.size_mm(p); }

  void collect_neighbours() {
    std::vector<std::vector<int>> along(points_.rows());
    neighbours_.resize(points_.rows());
    corner_ = coarse_.corner;
    for (const MeshEdge& edge : edges_) {
      const bool border = is_border(coarse_.surface, edge);
      if (border) chain_.push_back(edge.points);
      const bool diagonal = edge.count == 2 && pairs_.quad(edge.triangles[0]) >= 0 &&
                            pairs_.quad(edge.triangles[0]) == pairs_.quad(edge.triangles[1]);
      for (int i = 0; i < 2; ++i) {
        const int p = edge.points[i], q = edge.points[1 - i];
        if (border) along[p].push_back(q);
        if (!diagonal) neighbours_[p].push_back(q);
      }
    }
    for (Eigen::Index p = 0; p < points_.rows(); ++p) {
      if (along[p].empty()) continue;
      neighbours_[p] = along[p];
    }
    for (const auto& ends : chain_) on_chain_.insert({ends[0], 1}), on_chain_.insert({ends[1], 1});
    start_ = points_;
  }

  // Distances of the input's points, gathered triangle by triangle: 3×3 weights, 3 right-hand rows per metric.
  void add_samples(Equations& equations) {
    const TriangleTree tree(points_, coarse_.surface.triangles);
    const std::vector<TriangleTree::Hit> hits = tree.closest(target_.points, nearest_);
    nearest_.resize(hits.size());
    for (std::size_t s = 0; s < hits.size(); ++s) nearest_[s] = hits[s].triangle;
    const double mean_square = mean_squared(hits);
    std::vector<std::array<Eigen::Matrix3d, 6>> blocks(coarse_.surface.triangles.rows());
    std::vector<std::array<Eigen::Vector3d, 3>> rights(blocks.size());
    for (auto& b : blocks) b.fill(Eigen::Matrix3d::Zero());
    for (auto& r : rights) r.fill(Eigen::Vector3d::Zero());
    for (std::size_t s = 0; s < hits.size(); ++s) {
      const auto row = static_cast<Eigen::Index>(s);
      const int t = hits[s].triangle;
      const Eigen::Vector3d n = target_.normals.row(row).transpose(), at = target_.points.row(row).transpose();
      if (normal(t).dot(n) <= 0) continue;  // the other side of a thin sheet
      double weight = target_.area_mm2(row);
      if (options_.emphasis > 0 && mean_square > 0)
        weight *= std::min(largest_emphasis, std::pow(hits[s].squared_mm2 / mean_square + 0.1, options_.emphasis));
      const Eigen::Matrix3d metric =
          weight * ((1 - along_surface) * n * n.transpose() + along_surface * Eigen::Matrix3d::Identity());
      const Eigen::Vector3d& b = hits[s].weights;
      for (int i = 0, k = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j) blocks[t][k++] += b[i] * b[j] * metric;
      const Eigen::Vector3d right = metric * at;
      for (int i = 0; i < 3; ++i) rights[t][i] += b[i] * right;
    }
    for (std::size_t t = 0; t < blocks.size(); ++t)
      for (int i = 0, k = 0; i < 3; ++i) {
        const int p = coarse_.surface.triangles(static_cast<Eigen::Index>(t), i);
        equations.add_right(p, rights[t][i]);
        for (int j = i; j < 3; ++j, ++k) {
          const int q = coarse_.surface.triangles(static_cast<Eigen::Index>(t), j);
          equations.add_block(p, q, blocks[t][k]);
          if (i != j) equations.add_block(q, p, blocks[t][k]);
        }
      }
  }

  static double mean_squared(const std::vector<TriangleTree::Hit>& hits) {
    double sum = 0;
    for (const TriangleTree::Hit& hit : hits) sum += hit.squared_mm2;
    return sum / static_cast<double>(hits.size());
  }

  // Samples of the input's borders to the nearest edge of the coarse borders, across the border's tangent.
  void add_borders(Equations& equations) {
    if (chain_.empty() || target_.border_points.rows() == 0) return;
    const TriangleTree tree(points_, as_triangles(chain_));
    const std::vector<TriangleTree::Hit> hits = tree.closest(target_.border_points);
    for (std::size_t s = 0; s < hits.size(); ++s) {
      const auto row = static_cast<Eigen::Index>(s);
      const auto& ends = chain_[hits[s].triangle];
      const Eigen::Vector3d t = target_.border_tangents.row(row).transpose();
      const double size = coarse_.size_mm(ends[0]);
      const Eigen::Matrix3d metric = border_weight * target_.border_mm * size *
                                     (Eigen::Matrix3d::Identity() - (1 - along_surface) * t * t.transpose());
      equations.add({{ends[0], hits[s].weights[0]}, {ends[1], hits[s].weights[1] + hits[s].weights[2]}}, metric,
                    target_.border_points.row(row).transpose());
    }
    for (int p = 0; p < static_cast<int>(corner_.size()); ++p)
      if (corner_[p])
        equations.add({{p, 1}}, corner_weight * area(p) * Eigen::Matrix3d::Identity(), start_.row(p).transpose());
  }

  // Each point towards the middle of its neighbours, in its tangent plane or along its border.
  void add_smoothing(Equations& equations) {
    for (int p = 0; p < points_.rows(); ++p) {
      if (neighbours_[p].empty() || corner_[p]) continue;
      std::vector<std::pair<int, double>> terms{{p, 1}};
      for (const int q : neighbours_[p]) terms.emplace_back(q, -1.0 / static_cast<double>(neighbours_[p].size()));
      Eigen::Matrix3d flat;
      if (on_chain_.count(p) && neighbours_[p].size() == 2) {
        const Eigen::Vector3d t =
            (points_.row(neighbours_[p][1]) - points_.row(neighbours_[p][0])).transpose().normalized();
        flat = t * t.transpose();
      } else {
        const Eigen::Vector3d n = coarse_.normals.row(p).transpose();
        flat = Eigen::Matrix3d::Identity() - n * n.transpose();
      }
      equations.add(terms, options_.smoothing * area(p) * flat, Eigen::Vector3d::Zero());
    }
  }

  // a − b + c − d vanishes for a parallelogram abcd.
  void add_squares(Equations& equations) {
    if (options_.square <= 0) return;
    std::vector<std::array<int, 2>> halves(pairs_.quads, {-1, -1});
    for (int t = 0; t < pairs_.quad.size(); ++t)
      if (const int quad = pairs_.quad(t); quad >= 0) halves[quad][halves[quad][0] < 0 ? 0 : 1] = t;
    for (const auto& [s, t] : halves) {
      std::map<int, int> times;
      for (int c = 0; c < 3; ++c) ++times[coarse_.surface.triangles(s, c)], ++times[coarse_.surface.triangles(t, c)];
      std::vector<std::pair<int, double>> terms;
      double size = 0;
      for (const auto& [p, n] : times) {
        terms.emplace_back(p, n == 2 ? 1 : -1);
        size += area(p) / 4;
      }
      equations.add(terms, options_.square * size * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
    }
  }

  Eigen::Vector3d normal(int t) const { return normal(points_, t); }
  Eigen::Vector3d normal(const Points& points, int t) const {
    const Eigen::RowVector3d a = points.row(coarse_.surface.triangles(t, 0));
    const Eigen::RowVector3d u = points.row(coarse_.surface.triangles(t, 1)) - a,
                             v = points.row(coarse_.surface.triangles(t, 2)) - a;
    return u.cross(v).transpose();
  }
  Eigen::Vector3d wanted_normal(int t) const {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 3; ++c) sum += coarse_.normals.row(coarse_.surface.triangles(t, c));
    return sum.transpose();
  }

  // Goes to the solution; points of triangles that would turn over go half of the way, again and again.
  void step(const Points& solution) {
    Eigen::VectorXd share = Eigen::VectorXd::Ones(points_.rows());
    Points next = solution;
    for (int halving = 0; halving < most_halvings; ++halving) {
      std::vector<int> turned;
      for (int t = 0; t < coarse_.surface.triangles.rows(); ++t) {
        const Eigen::Vector3d wanted = wanted_normal(t);
        if (normal(next, t).dot(wanted) <= 0 && normal(points_, t).dot(wanted) > 0) turned.push_back(t);
      }
      if (turned.empty()) break;
      std::vector<char> halve(points_.rows(), 0);
      for (const int t : turned)
        for (int c = 0; c < 3; ++c) halve[coarse_.surface.triangles(t, c)] = 1;
      for (Eigen::Index p = 0; p < share.size(); ++p)
        if (halve[p]) {
          share(p) *= halving + 1 < most_halvings ? 0.5 : 0;
          next.row(p) = points_.row(p) + share(p) * (solution.row(p) - points_.row(p));
        }
    }
    points_ = next;
  }

  const FitTarget& target_;
  const QuadPairs& pairs_;
  const FitOptions& options_;
  FieldMesh& coarse_;
  Points& points_;
  std::vector<int>& nearest_;
  Points start_;
  std::vector<MeshEdge> edges_;
  std::vector<std::vector<int>> neighbours_;  // along a chain: its two; else without diagonals of quads
  std::vector<std::array<int, 2>> chain_;
  std::map<int, int> on_chain_;
  std::vector<char> corner_;
};

}  // namespace

FitTarget::FitTarget(const Surface& input, int most_samples, std::shared_ptr<const TriangleTree> input_tree)
    : tree(std::move(input_tree)) {
  if (!tree) tree = std::make_shared<const TriangleTree>(input.points, input.triangles);
  const Points all_normals = reconstruction::point_normals(input.points, input.triangles);
  Eigen::VectorXd all_areas = Eigen::VectorXd::Zero(input.points.rows());
  for (Eigen::Index t = 0; t < input.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = input.points.row(input.triangles(t, 0));
    const Eigen::RowVector3d u = input.points.row(input.triangles(t, 1)) - a,
                             v = input.points.row(input.triangles(t, 2)) - a;
    for (int c = 0; c < 3; ++c) all_areas(input.triangles(t, c)) += u.cross(v).norm() / 6;
  }
  const Eigen::Index stride = std::max<Eigen::Index>(1, input.points.rows() / std::max(1, most_samples));
  const Eigen::Index count = (input.points.rows() + stride - 1) / stride;
  points.resize(count, 3);
  normals.resize(count, 3);
  area_mm2.resize(count);
  for (Eigen::Index s = 0; s < count; ++s) {
    points.row(s) = input.points.row(s * stride);
    normals.row(s) = all_normals.row(s * stride);
    area_mm2(s) = all_areas(s * stride) * static_cast<double>(stride);
  }
  std::vector<Eigen::RowVector3d> places, tangents;
  std::vector<std::array<int, 2>> chains;
  for (const MeshEdge& edge : reconstruction::mesh_edges(input.triangles)) {
    if (!is_border(input, edge)) continue;
    const Eigen::RowVector3d a = input.points.row(edge.points[0]), b = input.points.row(edge.points[1]);
    chains.push_back(edge.points);
    places.emplace_back(0.5 * (a + b));
    tangents.emplace_back((b - a).normalized());
    border_mm += (b - a).norm();
  }
  border_mm /= std::max<double>(1, static_cast<double>(places.size()));
  if (!chains.empty()) border = std::make_unique<TriangleTree>(input.points, as_triangles(chains));
  border_points.resize(static_cast<Eigen::Index>(places.size()), 3);
  border_tangents.resize(border_points.rows(), 3);
  for (std::size_t i = 0; i < places.size(); ++i) {
    border_points.row(static_cast<Eigen::Index>(i)) = places[i];
    border_tangents.row(static_cast<Eigen::Index>(i)) = tangents[i];
  }
}

void project(const FitTarget& target, Surface& surface) {
  const std::vector<char> on_border = border_points_of(surface, reconstruction::mesh_edges(surface.triangles));
#pragma omp parallel for schedule(dynamic, 512)
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p) {
    const TriangleTree& tree = on_border[p] && target.border ? *target.border : *target.tree;
    surface.points.row(p) = tree.closest(Eigen::Vector3d(surface.points.row(p).transpose())).point.transpose();
  }
}

void even_out(const FitTarget& target, const std::vector<Eigen::Vector3d>& places, double radius_mm, Surface& surface) {
  const std::vector<MeshEdge> edges = reconstruction::mesh_edges(surface.triangles);
  const std::vector<char> on_border = border_points_of(surface, edges);
  const std::vector<std::vector<int>> neighbours = reconstruction::point_neighbours(edges, surface.points.rows());
  for (int round = 0; round < 3; ++round) {
    Points next = surface.points;
    for (Eigen::Index p = 0; p < surface.points.rows(); ++p) {
      const Eigen::Vector3d at = surface.points.row(p).transpose();
      const bool near = std::any_of(places.begin(), places.end(), [&](const Eigen::Vector3d& place) {
        return (place - at).squaredNorm() <= radius_mm * radius_mm;
      });
      if (!near || on_border[p]) continue;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const int q : neighbours[p]) sum += surface.points.row(q).transpose();
      const Eigen::Vector3d middle = sum / static_cast<double>(neighbours[p].size());
      next.row(p) = target.tree->closest(middle).point.transpose();
    }
    surface.points = next;
  }
}

void fit_surface(const FitTarget& target, const QuadPairs& pairs, const FitOptions& options, FieldMesh& coarse,
                 std::vector<int>& nearest) {
  Fit(target, pairs, options, coarse, nearest).run();
}

}  // namespace supine::meshing
