// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/quad_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/max_cardinality_matching.hpp>
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

using Graph = boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS>;
using Mates = std::vector<boost::graph_traits<Graph>::vertex_descriptor>;
using MateMap = Mates::value_type*;
using Numbers = boost::property_map<Graph, boost::vertex_index_t>::const_type;

// Partner of every triangle, or −1. Starts from the pairs in their order, the squarest first, and changes them over
// along alternating paths until no more can be formed (Edmonds 1965, by Boost).
std::vector<int> largest_matching(Eigen::Index triangles, const std::vector<Pair>& pairs) {
  Graph graph(static_cast<std::size_t>(triangles));
  for (const Pair& pair : pairs) boost::add_edge(pair.a, pair.b, graph);
  Mates mates(static_cast<std::size_t>(triangles));
  boost::matching<Graph, MateMap, Numbers, boost::edmonds_augmenting_path_finder, boost::greedy_matching,
                  boost::no_matching_verifier>(graph, mates.data(), boost::get(boost::vertex_index, graph));
  std::vector<int> partner(mates.size(), -1);
  for (std::size_t t = 0; t < mates.size(); ++t)
    if (mates[t] != boost::graph_traits<Graph>::null_vertex()) partner[t] = static_cast<int>(mates[t]);
  return partner;
}

}  // namespace

QuadPairs pair_triangles(const Surface& surface, double largest_deviation_deg) {
  const std::vector<int> partner =
      largest_matching(surface.triangles.rows(), possible_pairs(surface, largest_deviation_deg));
  const auto count = static_cast<int>(surface.triangles.rows());
  QuadPairs result{Eigen::VectorXi::Constant(count, -1)};
  for (int t = 0; t < count; ++t) {
    const int other = partner[t];
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
