// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/remesh.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <cmath>

namespace supine::meshing {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using reconstruction::Surface;

using FaceRegions = Mesh::Property_map<Mesh::Face_index, int>;
using EdgeFlags = Mesh::Property_map<Mesh::Edge_index, bool>;

struct RegionMesh {
  Mesh mesh;
  FaceRegions region;
  EdgeFlags border;  // between two regions
};

RegionMesh to_cgal(const Surface& surface) {
  RegionMesh result;
  Mesh& mesh = result.mesh;
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p)
    mesh.add_vertex(Kernel::Point_3(surface.points(p, 0), surface.points(p, 1), surface.points(p, 2)));
  result.region = mesh.add_property_map<Mesh::Face_index, int>("f:region", 0).first;
  result.border = mesh.add_property_map<Mesh::Edge_index, bool>("e:border", false).first;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Mesh::Face_index face =
        mesh.add_face(Mesh::Vertex_index(surface.triangles(t, 0)), Mesh::Vertex_index(surface.triangles(t, 1)),
                      Mesh::Vertex_index(surface.triangles(t, 2)));
    if (surface.region.size() > 0) result.region[face] = surface.region(t);
  }
  for (const Mesh::Edge_index edge : mesh.edges()) {
    const auto half = mesh.halfedge(edge);
    result.border[edge] = result.region[mesh.face(half)] != result.region[mesh.face(mesh.opposite(half))];
  }
  return result;
}

Surface from_cgal(RegionMesh& from, bool with_regions) {
  Mesh& mesh = from.mesh;
  mesh.collect_garbage();
  Surface surface;
  surface.points.resize(static_cast<Eigen::Index>(mesh.number_of_vertices()), 3);
  surface.triangles.resize(static_cast<Eigen::Index>(mesh.number_of_faces()), 3);
  if (with_regions) surface.region.resize(surface.triangles.rows());
  for (const Mesh::Vertex_index v : mesh.vertices()) {
    const Kernel::Point_3& p = mesh.point(v);
    surface.points.row(static_cast<Eigen::Index>(v)) << p.x(), p.y(), p.z();
  }
  for (const Mesh::Face_index face : mesh.faces()) {
    const auto row = static_cast<Eigen::Index>(face);
    int corner = 0;
    for (const Mesh::Vertex_index v : mesh.vertices_around_face(mesh.halfedge(face)))
      surface.triangles(row, corner++) = static_cast<int>(v);
    if (with_regions) surface.region(row) = from.region[face];
  }
  return surface;
}

Eigen::Vector3d centroid(const Mesh& mesh, Mesh::Face_index face) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Mesh::Vertex_index v : mesh.vertices_around_face(mesh.halfedge(face))) {
    const Kernel::Point_3& p = mesh.point(v);
    sum += Eigen::Vector3d(p.x(), p.y(), p.z());
  }
  return sum / 3;
}

// Faces that no finer place claims: a place of level n claims what lies within twice its own edge length.
std::vector<Mesh::Face_index> faces_of_level(const Mesh& mesh, int level, double edge_mm,
                                             const std::vector<FinePlace>& fine) {
  std::vector<Mesh::Face_index> faces;
  for (const Mesh::Face_index face : mesh.faces()) {
    const Eigen::Vector3d at = centroid(mesh, face);
    const bool claimed = std::any_of(fine.begin(), fine.end(), [&](const FinePlace& place) {
      return place.level > level && (place.point_mm - at).norm() < 2 * edge_mm / std::exp2(level + 1);
    });
    if (!claimed) faces.push_back(face);
  }
  return faces;
}

}  // namespace

Surface remesh(const Surface& surface, double edge_mm, const std::vector<FinePlace>& fine, unsigned int iterations) {
  namespace pmp = CGAL::Polygon_mesh_processing;
  RegionMesh work = to_cgal(surface);
  int finest = 0;
  for (const FinePlace& place : fine) finest = std::max(finest, place.level);
  for (int level = finest; level >= 0; --level) {
    const std::vector<Mesh::Face_index> faces = faces_of_level(work.mesh, level, edge_mm, fine);
    pmp::isotropic_remeshing(faces, edge_mm / std::exp2(level), work.mesh,
                             pmp::parameters::number_of_iterations(iterations)
                                 .number_of_relaxation_steps(iterations > 1 ? 3 : 1)
                                 .edge_is_constrained_map(work.border)
                                 .face_patch_map(work.region)
                                 .relax_constraints(false));
  }
  return from_cgal(work, surface.region.size() > 0);
}

}  // namespace supine::meshing
