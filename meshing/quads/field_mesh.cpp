// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/field_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "meshing/quads/border_chains.h"
#include "meshing/quads/region_mesh.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;
using Vertex = RegionMesh::Vertex;
using Half = RegionMesh::Half;
using Edge = RegionMesh::Edge;

constexpr double longest_share = 1.5;        // of the wanted length: what a collapse may leave
constexpr double largest_turn_cosine = 0.2;  // between a triangle that a collapse leaves and the normals of its points
constexpr int most_splits = 12;

// Areas as vectors: their sum over the triangles a point stands for gives its normal.
Points area_vectors(const Surface& surface) {
  Points sums = Points::Zero(surface.points.rows(), 3);
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0));
    const Eigen::RowVector3d u = surface.points.row(surface.triangles(t, 1)) - a,
                             v = surface.points.row(surface.triangles(t, 2)) - a;
    const Eigen::RowVector3d sixth = u.cross(v) / 6;
    for (int c = 0; c < 3; ++c) sums.row(surface.triangles(t, c)) += sixth;
  }
  return sums;
}

class Adapter {
 public:
  Adapter(const FieldMesh& from, double share)
      : work_(from.surface, from.corner),
        area_(area_vectors(from.surface)),
        size_(from.size_mm.data(), from.size_mm.data() + from.size_mm.size()),
        share_(share) {
    // Normals handed over know more than the triangles they stand on.
    for (Eigen::Index p = 0; p < area_.rows(); ++p) normal_.push_back(from.normals.row(p) * area_.row(p).norm());
  }

  FieldMesh run(bool with_regions) {
    // Growing lengths keep the points evenly spread.
    for (double part = 1.0 / 8; part < 1; part *= std::numbers::sqrt2) collapse_short(part);
    collapse_short(1);
    for (int round = 0; round < most_splits && split_long(); ++round) {
    }
    return what_is_left(work_, with_regions, normal_, size_);
  }

 private:
  double length(Half half) const { return work_.mesh().calc_edge_length(half); }
  double wanted(Vertex a, Vertex b) const { return share_ * std::min(size_[a.idx()], size_[b.idx()]); }

  void collapse_short(double part) {
    const auto edges = static_cast<int>(work_.mesh().n_edges());
    for (int e = 0; e < edges; ++e) {
      const Edge edge(e);
      if (work_.mesh().status(edge).deleted()) continue;
      const Half half = work_.mesh().halfedge_handle(edge, 0), back = work_.mesh().halfedge_handle(edge, 1);
      const Vertex a = work_.mesh().from_vertex_handle(half), b = work_.mesh().to_vertex_handle(half);
      if (length(half) >= part * wanted(a, b)) continue;
      // The point that stands for less goes first.
      const bool a_first = normal_[a.idx()].squaredNorm() <= normal_[b.idx()].squaredNorm();
      if (!collapse(a_first ? half : back, part)) collapse(a_first ? back : half, part);
    }
  }

  bool collapse(Half half, double part) {
    if (!work_.may_collapse(half) || !keeps_shape(half, part)) return false;
    const int gone = work_.mesh().from_vertex_handle(half).idx(), stays = work_.mesh().to_vertex_handle(half).idx();
    normal_[stays] += normal_[gone];
    work_.collapse(half);
    return true;
  }

  bool keeps_shape(Half half, double part) const {
    const HalfMesh& mesh = work_.mesh();
    const Vertex gone = mesh.from_vertex_handle(half), stays = mesh.to_vertex_handle(half);
    const Eigen::Vector3d to = work_.at(stays);
    for (auto h = mesh.cvoh_begin(gone); h != mesh.cvoh_end(gone); ++h) {
      const Vertex first = mesh.to_vertex_handle(*h);
      const double longest = longest_share * part * wanted(stays, first);
      if ((work_.at(first) - to).squaredNorm() > longest * longest) return false;
      if (mesh.is_boundary(*h)) continue;
      const Vertex second = mesh.to_vertex_handle(mesh.next_halfedge_handle(*h));
      if (first == stays || second == stays) continue;
      const Eigen::Vector3d normal = (work_.at(first) - to).cross(work_.at(second) - to);
      const Eigen::Vector3d wanted_normal = normal_[first.idx()] + normal_[second.idx()] + normal_[stays.idx()];
      const double along = normal.dot(wanted_normal);
      if (along <= 0 || along * along < largest_turn_cosine * largest_turn_cosine * normal.squaredNorm() *
                                            wanted_normal.squaredNorm())
        return false;
    }
    return true;
  }

  bool split_long() {
    bool any = false;
    const auto edges = static_cast<int>(work_.mesh().n_edges());
    for (int e = 0; e < edges; ++e) {
      const Edge edge(e);
      if (work_.mesh().status(edge).deleted()) continue;
      const Half half = work_.mesh().halfedge_handle(edge, 0);
      const Vertex a = work_.mesh().from_vertex_handle(half), b = work_.mesh().to_vertex_handle(half);
      if (length(half) <= 2 * wanted(a, b)) continue;
      const int i = a.idx(), j = b.idx();
      work_.split(edge);
      normal_.push_back(0.5 * (normal_[i].normalized() + normal_[j].normalized()) *
                        std::min(normal_[i].norm(), normal_[j].norm()));
      size_.push_back(0.5 * (size_[i] + size_[j]));
      any = true;
    }
    return any;
  }

  RegionMesh work_;
  Points area_;
  std::vector<Eigen::Vector3d> normal_;  // as long as the area stood for
  std::vector<double> size_;
  double share_;
};

}  // namespace

FieldMesh field_mesh(const Surface& surface, const Eigen::VectorXd& size_mm) {
  FieldMesh mesh{surface, area_vectors(surface), size_mm, BorderChains(surface).corners(size_mm)};
  for (Eigen::Index p = 0; p < mesh.normals.rows(); ++p)
    mesh.normals.row(p) /= std::max(mesh.normals.row(p).norm(), std::numeric_limits<double>::min());
  return mesh;
}

FieldMesh adapt(const FieldMesh& from, double share) {
  return Adapter(from, share).run(from.surface.region.size() > 0);
}

}  // namespace supine::meshing
