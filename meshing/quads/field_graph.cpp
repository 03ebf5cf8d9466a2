// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/field_graph.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "meshing/quads/border_chains.h"
#include "meshing/quads/curvature.h"
#include "reconstruction/mesh_edges.h"

namespace supine::meshing {
namespace {

using reconstruction::MeshEdge;

constexpr int coarsest = 8;              // points
constexpr double least_agreement = 0.3;  // of the normals of points that are merged
constexpr double worthwhile = 0.8;       // a level with more points than this share of the last is none

struct Link {
  int a, b;  // a < b
  double weight;
};

void set_links(FieldGraph& graph, const std::vector<Link>& links) {
  std::vector<std::tuple<int, int, double>> directed;
  directed.reserve(2 * links.size());
  for (const Link& link : links) {
    directed.emplace_back(link.a, link.b, link.weight);
    directed.emplace_back(link.b, link.a, link.weight);
  }
  std::sort(directed.begin(), directed.end());
  graph.start.assign(graph.size() + 1, 0);
  for (const auto& [from, to, weight] : directed) {
    ++graph.start[from + 1];
    graph.neighbour.push_back(to);
    graph.weight.push_back(weight);
  }
  for (int p = 0; p < graph.size(); ++p) graph.start[p + 1] += graph.start[p];
}

// Greedy colouring in the order of the points.
void colour(FieldGraph& graph) {
  std::vector<int> colour_of(graph.size(), -1);
  std::vector<char> taken;
  for (int p = 0; p < graph.size(); ++p) {
    taken.assign(graph.colours.size() + 1, 0);
    for (int i = graph.start[p]; i < graph.start[p + 1]; ++i)
      if (const int c = colour_of[graph.neighbour[i]]; c >= 0) taken[c] = 1;
    const auto c = static_cast<std::size_t>(std::find(taken.begin(), taken.end(), 0) - taken.begin());
    if (c == graph.colours.size()) graph.colours.emplace_back();
    colour_of[p] = static_cast<int>(c);
    graph.colours[c].push_back(p);
  }
}

// Tangents of borders over a wanted edge length. A corner has no direction of its own.
void set_borders(FieldGraph& graph, const FieldMesh& mesh) {
  graph.line = Points::Zero(graph.size(), 3);
  graph.on_line = graph.points;
  graph.corner = mesh.corner;
  const BorderChains chains(mesh.surface);
  for (int p = 0; p < graph.size(); ++p) {
    if (!chains.on_border(p) || graph.corner[p]) continue;
    const Eigen::RowVector3d n = graph.normals.row(p), t = chains.tangent(p, 0.5 * graph.size_mm(p));
    const Eigen::RowVector3d tangent = t - t.dot(n) * n;
    if (tangent.norm() > 0.1) graph.line.row(p) = tangent.normalized();
  }
}

FieldGraph finest(const FieldMesh& mesh) {
  FieldGraph graph;
  graph.points = mesh.surface.points;
  graph.normals = mesh.normals;
  graph.size_mm = mesh.size_mm;
  graph.area_mm2 = Eigen::VectorXd::Zero(graph.size());
  for (Eigen::Index t = 0; t < mesh.surface.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = graph.points.row(mesh.surface.triangles(t, 0));
    const Eigen::RowVector3d u = graph.points.row(mesh.surface.triangles(t, 1)) - a,
                             v = graph.points.row(mesh.surface.triangles(t, 2)) - a;
    for (int c = 0; c < 3; ++c) graph.area_mm2(mesh.surface.triangles(t, c)) += u.cross(v).norm() / 6;
  }
  const std::vector<MeshEdge> edges = reconstruction::mesh_edges(mesh.surface.triangles);
  std::vector<Link> links;
  for (const MeshEdge& edge : edges) links.push_back({edge.points[0], edge.points[1], 1});
  set_links(graph, links);
  set_borders(graph, mesh);
  graph.wish = curvature_wishes(graph);
  colour(graph);
  return graph;
}

// Parents: the best pairs first; points left over join the pair of a neighbour, so that a level has at most half the
// points of the one before. Points whose normals differ much stay apart: they lie on two sides of a thin sheet.
std::vector<int> parents(const FieldGraph& fine, int& count) {
  struct Candidate {
    double score;
    int a, b;
  };
  std::vector<Candidate> candidates;
  for (int p = 0; p < fine.size(); ++p)
    for (int i = fine.start[p]; i < fine.start[p + 1]; ++i) {
      const int q = fine.neighbour[i];
      const double agreement = fine.normals.row(p).dot(fine.normals.row(q));
      if (q < p || agreement < least_agreement) continue;
      const double a = fine.area_mm2(p), b = fine.area_mm2(q);
      candidates.push_back({agreement * (a > b ? b / a : a / b), p, q});
    }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& x, const Candidate& y) {
    return std::tie(y.score, x.a, x.b) < std::tie(x.score, y.a, y.b);
  });
  std::vector<int> parent(fine.size(), -1);
  count = 0;
  for (const Candidate& c : candidates)
    if (parent[c.a] < 0 && parent[c.b] < 0) parent[c.a] = parent[c.b] = count++;
  const int paired = count;
  for (const Candidate& c : candidates) {
    if (parent[c.a] < 0 && parent[c.b] >= 0 && parent[c.b] < paired) parent[c.a] = parent[c.b];
    if (parent[c.b] < 0 && parent[c.a] >= 0 && parent[c.a] < paired) parent[c.b] = parent[c.a];
  }
  for (int& p : parent)
    if (p < 0) p = count++;
  return parent;
}

// Borders and wishes are those of the surest of the points merged.
void merge_points(const FieldGraph& fine, const std::vector<int>& members, int row, FieldGraph& coarse) {
  Eigen::RowVector3d at = Eigen::RowVector3d::Zero(), normal = at;
  double area = 0, size = 0, weights = 0;
  const auto rank = [&fine](int p) { return fine.corner[p] ? 2 : fine.line.row(p).squaredNorm() > 0 ? 1 : 0; };
  int lined = members.front(), wished = members.front();
  for (const int p : members) {
    const double weight = std::max(fine.area_mm2(p), std::numeric_limits<double>::min());
    area += fine.area_mm2(p);
    weights += weight;
    at += weight * fine.points.row(p);
    normal += weight * fine.normals.row(p);
    size += weight * fine.size_mm(p);
    if (rank(p) > rank(lined)) lined = p;
    if (fine.wish.row(p).squaredNorm() > fine.wish.row(wished).squaredNorm() + 1e-9) wished = p;
  }
  coarse.area_mm2(row) = area;
  coarse.size_mm(row) = size / weights;
  coarse.points.row(row) = at / weights;
  const Eigen::RowVector3d n =
      normal.norm() > 1e-3 * weights ? Eigen::RowVector3d(normal.normalized()) : fine.normals.row(members.front());
  coarse.normals.row(row) = n;
  const auto flat = [&n](const Eigen::RowVector3d& v) { return Eigen::RowVector3d(v - v.dot(n) * n); };
  const Eigen::RowVector3d line = flat(fine.line.row(lined));
  if (line.norm() > 1e-3) coarse.line.row(row) = line.normalized();
  coarse.on_line.row(row) = coarse.points.row(row) + flat(fine.on_line.row(lined) - coarse.points.row(row));
  coarse.corner[row] = fine.corner[lined];
  coarse.wish.row(row) = flat(fine.wish.row(wished));
}

FieldGraph coarser(FieldGraph& fine) {
  int count = 0;
  fine.parent = parents(fine, count);
  FieldGraph coarse;
  coarse.points.resize(count, 3);
  coarse.normals.resize(count, 3);
  coarse.line = coarse.on_line = coarse.wish = Points::Zero(count, 3);
  coarse.area_mm2.resize(count);
  coarse.size_mm.resize(count);
  coarse.corner.assign(count, 0);
  std::vector<std::vector<int>> members(count);
  for (int p = 0; p < fine.size(); ++p) members[fine.parent[p]].push_back(p);
  for (int row = 0; row < count; ++row) merge_points(fine, members[row], row, coarse);
  std::vector<Link> all;
  for (int p = 0; p < fine.size(); ++p)
    for (int i = fine.start[p]; i < fine.start[p + 1]; ++i) {
      const int a = fine.parent[p], b = fine.parent[fine.neighbour[i]];
      if (a < b) all.push_back({a, b, fine.weight[i]});
    }
  std::stable_sort(all.begin(), all.end(),
                   [](const Link& x, const Link& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); });
  std::vector<Link> links;
  for (const Link& link : all) {
    if (!links.empty() && links.back().a == link.a && links.back().b == link.b)
      links.back().weight += link.weight;
    else
      links.push_back(link);
  }
  set_links(coarse, links);
  colour(coarse);
  return coarse;
}

}  // namespace

std::vector<FieldGraph> field_hierarchy(const FieldMesh& mesh) {
  std::vector<FieldGraph> levels;
  levels.push_back(finest(mesh));
  while (levels.back().size() > coarsest) {
    FieldGraph next = coarser(levels.back());
    if (next.size() > worthwhile * levels.back().size()) {
      levels.back().parent.clear();
      break;
    }
    levels.push_back(std::move(next));
  }
  return levels;
}

}  // namespace supine::meshing
