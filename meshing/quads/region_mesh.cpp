// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/region_mesh.h"

#include "meshing/quads/field_mesh.h"

namespace supine::meshing {

using reconstruction::Surface;

RegionMesh::RegionMesh(const Surface& surface, const std::vector<char>& corner)
    : region_(surface.triangles.rows(), 0), corner_(corner) {
  mesh_.reserve(surface.points.rows(), 3 * surface.triangles.rows() / 2, surface.triangles.rows());
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p)
    mesh_.add_vertex({surface.points(p, 0), surface.points(p, 1), surface.points(p, 2)});
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    mesh_.add_face(Vertex(surface.triangles(t, 0)), Vertex(surface.triangles(t, 1)), Vertex(surface.triangles(t, 2)));
    if (surface.region.size() > 0) region_[t] = surface.region(t);
  }
  on_border_.assign(mesh_.n_vertices(), 0);
  for (const Edge edge : mesh_.edges())
    if (border(edge)) {
      const Half half = mesh_.halfedge_handle(edge, 0);
      on_border_[mesh_.to_vertex_handle(half).idx()] = on_border_[mesh_.from_vertex_handle(half).idx()] = 1;
    }
}

bool RegionMesh::border(Edge edge) const {
  const Half half = mesh_.halfedge_handle(edge, 0);
  const Face a = mesh_.face_handle(half), b = mesh_.opposite_face_handle(half);
  return !a.is_valid() || !b.is_valid() || region_[a.idx()] != region_[b.idx()];
}

// A triangle whose other two edges are both borders must not vanish: two borders would become one edge.
bool RegionMesh::single_chain(Half half) const {
  for (const Half side : {half, mesh_.opposite_halfedge_handle(half)}) {
    if (mesh_.is_boundary(side)) continue;
    const Half next = mesh_.next_halfedge_handle(side), last = mesh_.prev_halfedge_handle(side);
    if (border(mesh_.edge_handle(next)) && border(mesh_.edge_handle(last))) return false;
  }
  return true;
}

bool RegionMesh::may_collapse(Half half) const {
  const Vertex gone = mesh_.from_vertex_handle(half), stays = mesh_.to_vertex_handle(half);
  if (corner(gone)) return false;
  if (on_border(gone)) {
    if (!on_border(stays) || !border(mesh_.edge_handle(half))) return false;
    if (!single_chain(half)) return false;
  }
  return keeps_topology(half);
}

// The link condition, as OpenMesh's is_collapse_ok() tests it; that asks for a property by its name at every call.
bool RegionMesh::keeps_topology(Half half) const {
  const Half back = mesh_.opposite_halfedge_handle(half);
  if (mesh_.status(mesh_.edge_handle(half)).deleted()) return false;
  Vertex beside[2];
  for (int i = 0; i < 2; ++i) {
    const Half side = i == 0 ? half : back;
    if (mesh_.is_boundary(side)) continue;
    const Half next = mesh_.next_halfedge_handle(side), last = mesh_.next_halfedge_handle(next);
    beside[i] = mesh_.to_vertex_handle(next);
    if (mesh_.is_boundary(mesh_.opposite_halfedge_handle(next)) &&
        mesh_.is_boundary(mesh_.opposite_halfedge_handle(last)))
      return false;
  }
  if (beside[0] == beside[1]) return false;
  const Vertex gone = mesh_.from_vertex_handle(half), stays = mesh_.to_vertex_handle(half);
  if (mesh_.is_boundary(gone) && mesh_.is_boundary(stays) && !mesh_.is_boundary(half) && !mesh_.is_boundary(back))
    return false;
  for (auto a = mesh_.cvv_begin(gone); a.is_valid(); ++a) {
    if (*a == beside[0] || *a == beside[1]) continue;
    for (auto b = mesh_.cvv_begin(stays); b.is_valid(); ++b)
      if (*a == *b) return false;
  }
  return true;
}

bool RegionMesh::may_flip(Edge edge) const { return !border(edge) && mesh_.is_flip_ok(edge); }

RegionMesh::Vertex RegionMesh::split(Edge edge) {
  const Half half = mesh_.halfedge_handle(edge, 0);
  const bool chain = border(edge);
  const Face a = mesh_.face_handle(half), b = mesh_.opposite_face_handle(half);
  const Vertex left = a.is_valid() ? mesh_.to_vertex_handle(mesh_.next_halfedge_handle(half)) : Vertex();
  const int region_a = a.is_valid() ? region_[a.idx()] : 0, region_b = b.is_valid() ? region_[b.idx()] : 0;
  const Vertex from = mesh_.from_vertex_handle(half), to = mesh_.to_vertex_handle(half);
  const Vertex middle = mesh_.add_vertex(0.5 * (mesh_.point(from) + mesh_.point(to)));
  mesh_.split(edge, middle);
  on_border_.push_back(chain ? 1 : 0);
  corner_.push_back(0);
  region_.resize(mesh_.n_faces(), 0);
  // The faces round the new vertex lie on two sides of the old edge.
  for (auto h = mesh_.cvoh_begin(middle); h != mesh_.cvoh_end(middle); ++h) {
    const Face face = mesh_.face_handle(*h);
    if (!face.is_valid()) continue;
    const Vertex next = mesh_.to_vertex_handle(*h), last = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(*h));
    // Left of from→to lie (to, left) and (left, from).
    const bool on_left = (next == to && last == left) || (next == left && last == from);
    region_[face.idx()] = on_left ? region_a : region_b;
  }
  return middle;
}

Surface RegionMesh::surface(bool with_regions, std::vector<int>& kept) const {
  Surface result;
  std::vector<int> number(mesh_.n_vertices(), -1);
  kept.clear();
  std::vector<int> faces;
  for (std::size_t f = 0; f < mesh_.n_faces(); ++f)
    if (!mesh_.status(Face(static_cast<int>(f))).deleted()) faces.push_back(static_cast<int>(f));
  for (std::size_t v = 0; v < mesh_.n_vertices(); ++v) {
    const Vertex vertex(static_cast<int>(v));
    if (mesh_.status(vertex).deleted() || mesh_.is_isolated(vertex)) continue;
    number[v] = static_cast<int>(kept.size());
    kept.push_back(static_cast<int>(v));
  }
  result.points.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t p = 0; p < kept.size(); ++p)
    result.points.row(static_cast<Eigen::Index>(p)) = at(Vertex(kept[p])).transpose();
  result.triangles.resize(static_cast<Eigen::Index>(faces.size()), 3);
  if (with_regions) result.region.resize(result.triangles.rows());
  for (std::size_t t = 0; t < faces.size(); ++t) {
    int corner = 0;
    for (auto v = mesh_.cfv_begin(Face(faces[t])); v != mesh_.cfv_end(Face(faces[t])); ++v)
      result.triangles(static_cast<Eigen::Index>(t), corner++) = number[v->idx()];
    if (with_regions) result.region(static_cast<Eigen::Index>(t)) = region_[faces[t]];
  }
  return result;
}

FieldMesh what_is_left(const RegionMesh& mesh, bool with_regions, const std::vector<Eigen::Vector3d>& normals,
                       const std::vector<double>& sizes_mm) {
  FieldMesh result;
  std::vector<int> kept;
  result.surface = mesh.surface(with_regions, kept);
  result.normals.resize(result.surface.points.rows(), 3);
  result.size_mm.resize(result.surface.points.rows());
  for (Eigen::Index p = 0; p < result.normals.rows(); ++p) {
    result.normals.row(p) = normals[kept[p]].normalized().transpose();
    result.size_mm(p) = sizes_mm[kept[p]];
    result.corner.push_back(mesh.corner(RegionMesh::Vertex(kept[p])) ? 1 : 0);
  }
  return result;
}

}  // namespace supine::meshing
