// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/position_field.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace supine::meshing {
namespace {

Eigen::Vector3d row(const Points& points, int p) { return points.row(p).transpose(); }

// std::round is a call on plain x86-64 and this is the hot loop; ties go to even numbers.
double whole(double x) {
  constexpr double shift = 6755399441055744.0;  // 1.5 × 2^52
  return (x + shift) - shift;
}

struct Lattice {
  Eigen::Vector3d node, q, r;  // one node, two unit directions
  double size, inverse;

  Eigen::Vector3d below(const Eigen::Vector3d& at) const {
    const Eigen::Vector3d d = at - node;
    return node + q * (whole(q.dot(d) * inverse - 0.5) * size) + r * (whole(r.dot(d) * inverse - 0.5) * size);
  }
  Eigen::Vector3d nearest(const Eigen::Vector3d& at) const {
    const Eigen::Vector3d d = at - node;
    return node + q * (whole(q.dot(d) * inverse) * size) + r * (whole(r.dot(d) * inverse) * size);
  }
};

Lattice lattice(const FieldGraph& graph, const Points& q, const Eigen::Vector3d& node, int p) {
  const Eigen::Vector3d direction = row(q, p);
  return {node, direction, row(graph.normals, p).cross(direction), graph.size_mm(p), 1 / graph.size_mm(p)};
}

// Point between two points on both their tangent planes, the nearest to them.
Eigen::Vector3d middle_point(const Eigen::Vector3d& a, const Eigen::Vector3d& na, const Eigen::Vector3d& b,
                             const Eigen::Vector3d& nb) {
  const Eigen::Vector3d middle = 0.5 * (a + b);
  const double c = na.dot(nb), determinant = 1 - c * c;
  if (determinant < 1e-4) return middle;
  const double fa = na.dot(a - middle), fb = nb.dot(b - middle);
  return middle + ((fa - c * fb) * na + (fb - c * fa) * nb) / determinant;
}

// Of the nodes of a round the middle the one that b has a node nearest to, and that node of b.
std::pair<Eigen::Vector3d, Eigen::Vector3d> matching_nodes(const Lattice& a, const Lattice& b,
                                                           const Eigen::Vector3d& middle) {
  const Eigen::Vector3d base = a.below(middle);
  double best = std::numeric_limits<double>::infinity();
  std::pair<Eigen::Vector3d, Eigen::Vector3d> result{base, base};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d node_a = base + (i & 1) * a.size * a.q + (i >> 1) * a.size * a.r;
    const Eigen::Vector3d node_b = b.nearest(node_a);
    // A hair's preference for the first of equals keeps rounding from deciding.
    if (const double distance = (node_a - node_b).squaredNorm(); distance < best - 1e-12 * a.size * a.size) {
      best = distance;
      result = {node_a, node_b};
    }
  }
  return result;
}

Eigen::Vector3d smoothed(const FieldGraph& graph, const Points& q, const Points& nodes, int p) {
  const Eigen::Vector3d at = row(graph.points, p), n = row(graph.normals, p);
  const Eigen::Vector3d line = row(graph.line, p), on_line_at = row(graph.on_line, p);
  const bool on_line = line.squaredNorm() > 0;
  Lattice own = lattice(graph, q, row(nodes, p), p);
  if (graph.corner[p]) {
    own.node = on_line_at;
    return own.nearest(at);
  }
  double weight = 0;
  for (int i = graph.start[p]; i < graph.start[p + 1]; ++i) {
    const int other = graph.neighbour[i];
    const Eigen::Vector3d middle = middle_point(at, n, row(graph.points, other), row(graph.normals, other));
    const auto [a, b] = matching_nodes(own, lattice(graph, q, row(nodes, other), other), middle);
    // What lies on a border listens to the border first.
    const double w = graph.weight[i] * (on_line && graph.line.row(other).squaredNorm() > 0 ? 10 : 1);
    own.node = (a * weight + b * w) / (weight + w);
    weight += w;
    own.node -= n.dot(own.node - at) * n;
    if (on_line) own.node = on_line_at + line.dot(own.node - on_line_at) * line;
  }
  return own.nearest(at);
}

void sweep(const FieldGraph& graph, const Points& q, Points& nodes) {
  for (const std::vector<int>& colour : graph.colours) {
    const auto count = static_cast<std::ptrdiff_t>(colour.size());
#pragma omp parallel for schedule(static) if (count > 2000)
    for (std::ptrdiff_t i = 0; i < count; ++i) nodes.row(colour[i]) = smoothed(graph, q, nodes, colour[i]).transpose();
  }
}

}  // namespace

Points position_field(const std::vector<FieldGraph>& levels, const CrossField& crosses, int sweeps) {
  Points coarse;
  for (std::size_t l = levels.size(); l-- > 0;) {
    const FieldGraph& graph = levels[l];
    Points nodes = graph.points;
    if (l + 1 < levels.size())
      for (int p = 0; p < graph.size(); ++p) {
        const Eigen::Vector3d at = row(graph.points, p), n = row(graph.normals, p);
        Eigen::Vector3d node = row(coarse, graph.parent[p]);
        node -= n.dot(node - at) * n;
        const Eigen::Vector3d line = row(graph.line, p);
        const Eigen::Vector3d on_line = row(graph.on_line, p);
        if (line.squaredNorm() > 0) node = on_line + line.dot(node - on_line) * line;
        if (graph.corner[p]) node = on_line;
        nodes.row(p) = lattice(graph, crosses[l], node, p).nearest(at).transpose();
      }
    for (int s = 0; s < sweeps; ++s) sweep(graph, crosses[l], nodes);
    coarse = std::move(nodes);
  }
  return coarse;
}

void scale_sizes(std::vector<FieldGraph>& levels, double factor) {
  for (FieldGraph& level : levels) level.size_mm *= factor;
}

}  // namespace supine::meshing
