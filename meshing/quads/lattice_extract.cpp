// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/lattice_extract.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "meshing/quads/region_mesh.h"

namespace supine::meshing {
namespace {

using Vertex = RegionMesh::Vertex;
using Half = RegionMesh::Half;
using Edge = RegionMesh::Edge;

constexpr double one_node = 0.5;    // nodes nearer than this, of the spacing, are the same
constexpr double short_edge = 0.6;  // of the spacing; mended by a collapse
constexpr double long_edge = 1.75;  // mended by a split; a diagonal has 1.41
constexpr double flip_gain =
    0.2;  // rad by which opposite angles must exceed 180 degrees: a square's do by rounding only
constexpr double flat_angle = 2.3;   // rad; a triangle flat against a border
constexpr double fold_cosine = 0.5;  // a border that turns back by more is folded
constexpr int mending_rounds = 4;

class Extraction {
 public:
  Extraction(const FieldMesh& fields, const Points& cross, const Points& nodes) : work_(fields.surface, fields.corner) {
    for (Eigen::Index p = 0; p < nodes.rows(); ++p) {
      if (!work_.corner(Vertex(static_cast<int>(p)))) work_.move(Vertex(static_cast<int>(p)), nodes.row(p).transpose());
      cross_.emplace_back(cross.row(p).transpose());
      normal_.emplace_back(fields.normals.row(p).transpose());
      size_.push_back(fields.size_mm(p));
      count_.push_back(1);
    }
  }

  FieldMesh run(bool with_regions) {
    for (const double share : {0.1, 0.25, 0.4, one_node, one_node})
      for (int round = 0; round < 4 && collapse_nearer(share); ++round) {
      }
    for (int round = 0; round < mending_rounds; ++round) {
      unfold_borders();
      flip_edges();
      remove_threes();
      collapse_short();
      split_long();
    }
    flip_edges();
    remove_threes();
    return what_is_left(work_, with_regions, normal_, size_);
  }

 private:
  HalfMesh& mesh() { return work_.mesh(); }
  const HalfMesh& mesh() const { return work_.mesh(); }
  Vertex from(Half h) const { return mesh().from_vertex_handle(h); }
  Vertex to(Half h) const { return mesh().to_vertex_handle(h); }
  double size(Half h) const { return 0.5 * (size_[from(h).idx()] + size_[to(h).idx()]); }

  // Distance of two nodes in steps of the lattice: the larger of its two (and the height), mean of both frames.
  double steps(Half h) const {
    const Eigen::Vector3d d = work_.at(to(h)) - work_.at(from(h));
    double sum = 0;
    for (const Vertex v : {from(h), to(h)}) {
      const Eigen::Vector3d &q = cross_[v.idx()], &n = normal_[v.idx()];
      sum += std::max({std::abs(d.dot(q)), std::abs(d.dot(n.cross(q))), std::abs(d.dot(n))});
    }
    return 0.5 * sum / size(h);
  }

  // Removes the start; the end becomes the mean of both, unless it lies on a border that the start does not.
  void merge(Half h) {
    const int gone = from(h).idx(), stays = to(h).idx();
    const double share = static_cast<double>(count_[gone]) / (count_[gone] + count_[stays]);
    const bool fixed = work_.corner(to(h)) || (work_.on_border(to(h)) && !work_.on_border(from(h)));
    if (!fixed) {
      work_.move(to(h), (1 - share) * work_.at(to(h)) + share * work_.at(from(h)));
      const Eigen::Vector3d normal = (1 - share) * normal_[stays] + share * normal_[gone];
      if (normal.norm() > 0.1) normal_[stays] = normal.normalized();
      const Eigen::Vector3d flat = cross_[stays] - cross_[stays].dot(normal_[stays]) * normal_[stays];
      if (flat.norm() > 0.1) cross_[stays] = flat.normalized();
    }
    count_[stays] += count_[gone];
    work_.collapse(h);
  }

  bool try_merge(Edge edge) {
    const Half a = mesh().halfedge_handle(edge, 0), b = mesh().halfedge_handle(edge, 1);
    const bool a_first = count_[from(a).idx()] <= count_[from(b).idx()];
    for (const Half h : {a_first ? a : b, a_first ? b : a})
      if (work_.may_collapse(h)) {
        merge(h);
        return true;
      }
    return false;
  }

  bool collapse_nearer(double share) {
    bool any = false;
    const auto edges = static_cast<int>(mesh().n_edges());
    for (int e = 0; e < edges; ++e) {
      const Edge edge(e);
      if (mesh().status(edge).deleted() || steps(mesh().halfedge_handle(edge, 0)) >= share) continue;
      any = try_merge(edge) || any;
    }
    return any;
  }

  double angle_opposite(Half h) const {
    const Eigen::Vector3d at = work_.at(to(mesh().next_halfedge_handle(h)));
    const Eigen::Vector3d u = work_.at(from(h)) - at, v = work_.at(to(h)) - at;
    return std::atan2(u.cross(v).norm(), u.dot(v));
  }

  // A triangle is turned over when it faces away from the normals of its corners.
  bool upright(Vertex a, Vertex b, Vertex c) const {
    const Eigen::Vector3d normal = (work_.at(b) - work_.at(a)).cross(work_.at(c) - work_.at(a));
    return normal.dot(normal_[a.idx()] + normal_[b.idx()] + normal_[c.idx()]) > 0;
  }

  // A triangle between two edges of a border (or between a border and a chord of it) lies on the wrong side of a sharp
  // rim as soon as the border bends.
  bool ear(Vertex a, Vertex b, Vertex c) const {
    int borders = 0;
    for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}})
      if (const Half h = mesh().find_halfedge(from, to); h.is_valid() && work_.border(mesh().edge_handle(h))) ++borders;
    return borders > 1;
  }

  bool flip_helps(Edge edge) const {
    const Half h = mesh().halfedge_handle(edge, 0), o = mesh().halfedge_handle(edge, 1);
    const Vertex a = from(h), b = to(h), c = to(mesh().next_halfedge_handle(h)), d = to(mesh().next_halfedge_handle(o));
    const bool chord = work_.on_border(a) && work_.on_border(b), chord_then = work_.on_border(c) && work_.on_border(d);
    if (chord && !chord_then &&
        (ear(a, b, c) || ear(b, a, d) || std::max(angle_opposite(h), angle_opposite(o)) > flat_angle))
      return true;
    if (!chord && chord_then) return false;
    const int before = (upright(a, b, c) ? 1 : 0) + (upright(b, a, d) ? 1 : 0);
    const int after = (upright(a, d, c) ? 1 : 0) + (upright(d, b, c) ? 1 : 0);
    if (after != before) return after > before;
    return angle_opposite(h) + angle_opposite(o) > std::numbers::pi + flip_gain;
  }

  void flip_edges() {
    bool any = true;
    for (int round = 0; round < 10 && any; ++round) {
      any = false;
      for (int e = 0; e < static_cast<int>(mesh().n_edges()); ++e) {
        const Edge edge(e);
        if (mesh().status(edge).deleted() || !work_.may_flip(edge) || !flip_helps(edge)) continue;
        mesh().flip(edge);
        any = true;
      }
    }
  }

  // A point of three triangles inside a region is none of a lattice.
  void remove_threes() {
    for (int v = 0; v < static_cast<int>(mesh().n_vertices()); ++v) {
      const Vertex vertex(v);
      if (mesh().status(vertex).deleted() || work_.on_border(vertex) || mesh().valence(vertex) != 3) continue;
      for (auto h = mesh().voh_begin(vertex); h != mesh().voh_end(vertex); ++h)
        if (work_.may_collapse(*h)) {
          work_.collapse(*h);
          break;
        }
    }
  }

  // Nodes of a border in the wrong order leave a fold: its tip goes.
  void unfold_borders() {
    for (int v = 0; v < static_cast<int>(mesh().n_vertices()); ++v) {
      const Vertex vertex(v);
      if (mesh().status(vertex).deleted() || !work_.on_border(vertex) || work_.corner(vertex)) continue;
      std::vector<Half> along;
      for (auto h = mesh().voh_begin(vertex); h != mesh().voh_end(vertex); ++h)
        if (work_.border(mesh().edge_handle(*h))) along.push_back(*h);
      const Eigen::Vector3d one = work_.at(to(along[0])) - work_.at(vertex),
                            two = work_.at(to(along[1])) - work_.at(vertex);
      if (one.dot(two) < fold_cosine * one.norm() * two.norm()) continue;
      if (one.norm() > two.norm()) std::swap(along[0], along[1]);
      for (const Half h : along)
        if (work_.may_collapse(h)) {
          work_.collapse(h);
          break;
        }
    }
  }

  void collapse_short() {
    const auto edges = static_cast<int>(mesh().n_edges());
    for (int e = 0; e < edges; ++e) {
      const Edge edge(e);
      if (mesh().status(edge).deleted()) continue;
      const Half h = mesh().halfedge_handle(edge, 0);
      if (mesh().calc_edge_length(h) < short_edge * size(h)) try_merge(edge);
    }
  }

  void split_long() {
    const auto edges = static_cast<int>(mesh().n_edges());
    for (int e = 0; e < edges; ++e) {
      const Edge edge(e);
      if (mesh().status(edge).deleted()) continue;
      const Half h = mesh().halfedge_handle(edge, 0);
      if (mesh().calc_edge_length(h) <= long_edge * size(h)) continue;
      const int a = from(h).idx(), b = to(h).idx();
      const double wanted = size(h);
      work_.split(edge);
      normal_.emplace_back((normal_[a] + normal_[b]).normalized());
      cross_.push_back(cross_[a]);
      size_.push_back(wanted);
      count_.push_back(1);
    }
  }

  RegionMesh work_;
  std::vector<Eigen::Vector3d> cross_, normal_;
  std::vector<double> size_;
  std::vector<int> count_;  // points of the field mesh in each node
};

}  // namespace

FieldMesh extract_lattice(const FieldMesh& fields, const Points& cross, const Points& nodes) {
  return Extraction(fields, cross, nodes).run(fields.surface.region.size() > 0);
}

}  // namespace supine::meshing
