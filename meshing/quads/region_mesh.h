// SPDX-License-Identifier: AGPL-3.0-or-later
// For .cpp files of this folder only: OpenMesh stays behind them.
#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

struct FieldMesh;

struct RegionTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
};
using HalfMesh = OpenMesh::TriMesh_ArrayKernelT<RegionTraits>;

/// Half-edge triangles whose region borders (and open borders) stay chains: what may be collapsed, flipped, split.
class RegionMesh {
 public:
  using Vertex = OpenMesh::VertexHandle;
  using Half = OpenMesh::HalfedgeHandle;
  using Edge = OpenMesh::EdgeHandle;
  using Face = OpenMesh::FaceHandle;

  /// @param corner  by point: 1 for points that must stay
  /// @pre  manifold, consistently oriented
  RegionMesh(const reconstruction::Surface& surface, const std::vector<char>& corner);

  HalfMesh& mesh() { return mesh_; }
  const HalfMesh& mesh() const { return mesh_; }
  int region(Face face) const { return region_[face.idx()]; }

  Eigen::Vector3d at(Vertex v) const {
    const OpenMesh::Vec3d& p = mesh_.point(v);
    return {p[0], p[1], p[2]};
  }
  void move(Vertex v, const Eigen::Vector3d& to) { mesh_.set_point(v, {to.x(), to.y(), to.z()}); }

  bool border(Edge edge) const;  ///< between two regions, or open
  bool on_border(Vertex vertex) const { return on_border_[vertex.idx()] != 0; }
  bool corner(Vertex vertex) const { return corner_[vertex.idx()] != 0; }

  /// Whether removing the half-edge's start keeps topology, chains and their corners.
  bool may_collapse(Half half) const;
  void collapse(Half half) { mesh_.collapse(half); }

  /// Whether turning the edge keeps topology and chains.
  bool may_flip(Edge edge) const;

  /// Puts a new vertex into the middle of an edge. @return it
  Vertex split(Edge edge);

  /// The triangles left; @p kept gets the vertex of every point.
  reconstruction::Surface surface(bool with_regions, std::vector<int>& kept) const;

 private:
  bool single_chain(Half half) const;
  bool keeps_topology(Half half) const;

  HalfMesh mesh_;
  std::vector<int> region_;
  std::vector<char> on_border_, corner_;  // by vertex: true once, true for ever, for chains never end
};

/// The triangles left, with what they carry.
/// @param normals, sizes_mm  by vertex of @p mesh; normals of any length
FieldMesh what_is_left(const RegionMesh& mesh, bool with_regions, const std::vector<Eigen::Vector3d>& normals,
                       const std::vector<double>& sizes_mm);

}  // namespace supine::meshing
