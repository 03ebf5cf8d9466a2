// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/surface/remesh.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

namespace supine::meshing {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using reconstruction::Surface;

// Where levels of fineness meet and where a region ends in a tip, remeshing leaves needles.
constexpr double needle_angle = 0.2, bad_angle = 0.4;  // rad
constexpr double largest_bend_cosine = 0.8;

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

using Half = Mesh::Halfedge_index;

Eigen::Vector3d position(const Mesh& mesh, Mesh::Vertex_index v) {
  const Kernel::Point_3& p = mesh.point(v);
  return {p.x(), p.y(), p.z()};
}

// Whether a place of @p level or finer claims a face: those within twice that level's edge length.
bool claimed(const Mesh& mesh, Mesh::Face_index face, int level, double edge_mm, const std::vector<FinePlace>& fine) {
  const Half half = mesh.halfedge(face);
  const Eigen::Vector3d at = (position(mesh, mesh.source(half)) + position(mesh, mesh.target(half)) +
                              position(mesh, mesh.target(mesh.next(half)))) /
                             3;
  return std::any_of(fine.begin(), fine.end(), [&](const FinePlace& place) {
    return place.level >= level && (place.point_mm - at).norm() < 2 * edge_mm / std::exp2(level);
  });
}

std::vector<Mesh::Face_index> faces_where(const Mesh& mesh, const std::function<bool(Mesh::Face_index)>& wanted) {
  std::vector<Mesh::Face_index> faces;
  for (const Mesh::Face_index face : mesh.faces())
    if (wanted(face)) faces.push_back(face);
  return faces;
}

double smallest_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const auto at = [](const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r) {
    return std::atan2((q - p).cross(r - p).norm(), (q - p).dot(r - p));
  };
  return std::min({at(a, b, c), at(b, c, a), at(c, a, b)});
}

double smallest_angle(const Mesh& mesh, Mesh::Face_index face) {
  const Half half = mesh.halfedge(face);
  return smallest_angle(position(mesh, mesh.source(half)), position(mesh, mesh.target(half)),
                        position(mesh, mesh.target(mesh.next(half))));
}

// A needle along a region border goes to the region across its longest border edge: the border moves by its width.
void give_needles_away(RegionMesh& work) {
  Mesh& mesh = work.mesh;
  for (const Mesh::Face_index face : mesh.faces()) {
    if (smallest_angle(mesh, face) > needle_angle) continue;
    Half longest;
    double longest_mm = 0;
    for (const Half half : mesh.halfedges_around_face(mesh.halfedge(face))) {
      const double length = (position(mesh, mesh.source(half)) - position(mesh, mesh.target(half))).norm();
      if (!work.border[mesh.edge(half)] || length <= longest_mm) continue;
      longest = half;
      longest_mm = length;
    }
    if (longest_mm == 0) continue;
    work.region[face] = work.region[mesh.face(mesh.opposite(longest))];
    for (const Half half : mesh.halfedges_around_face(mesh.halfedge(face)))
      work.border[mesh.edge(half)] = work.region[face] != work.region[mesh.face(mesh.opposite(half))];
  }
}

// Whether turning the edge between its two triangles makes the smallest angle larger and bends the surface little.
bool flip_helps(const Mesh& mesh, Half half) {
  const Half opposite = mesh.opposite(half);
  const Mesh::Vertex_index left = mesh.target(mesh.next(half)), right = mesh.target(mesh.next(opposite));
  if (mesh.halfedge(left, right).is_valid() || left == right) return false;
  const Eigen::Vector3d a = position(mesh, mesh.source(half)), b = position(mesh, mesh.target(half)),
                        c = position(mesh, left), d = position(mesh, right);
  const double before = std::min(smallest_angle(a, b, c), smallest_angle(b, a, d));
  const double after = std::min(smallest_angle(a, d, c), smallest_angle(d, b, c));
  if (before > bad_angle || after <= before + 0.01) return false;
  const Eigen::Vector3d old_normal = ((b - a).cross(c - a) + (a - b).cross(d - b)).normalized();
  return (d - a).cross(c - a).normalized().dot(old_normal) > largest_bend_cosine &&
         (b - d).cross(c - d).normalized().dot(old_normal) > largest_bend_cosine;
}

void flip_bad_edges(RegionMesh& work) {
  bool flipped = true;
  for (int pass = 0; pass < 10 && flipped; ++pass) {
    flipped = false;
    for (const Mesh::Edge_index edge : work.mesh.edges()) {
      const Half half = work.mesh.halfedge(edge);
      if (work.border[edge] || !flip_helps(work.mesh, half)) continue;
      CGAL::Euler::flip_edge(half, work.mesh);
      flipped = true;
    }
  }
}

void remesh_faces(RegionMesh& work, const std::vector<Mesh::Face_index>& faces, double edge_mm,
                  unsigned int iterations) {
  namespace pmp = CGAL::Polygon_mesh_processing;
  pmp::isotropic_remeshing(faces, edge_mm, work.mesh,
                           pmp::parameters::number_of_iterations(iterations)
                               .number_of_relaxation_steps(iterations > 1 ? 3 : 1)
                               .edge_is_constrained_map(work.border)
                               .face_patch_map(work.region)
                               .relax_constraints(false));
}

Surface cleaned(RegionMesh& work, bool with_regions) {
  for (int round = 0; round < 3; ++round) {
    give_needles_away(work);
    flip_bad_edges(work);
  }
  return from_cgal(work, with_regions);
}

int finest_level(const std::vector<FinePlace>& fine) {
  int finest = 0;
  for (const FinePlace& place : fine) finest = std::max(finest, place.level);
  return finest;
}

}  // namespace

Surface remesh(const Surface& surface, double edge_mm, const std::vector<FinePlace>& fine, unsigned int iterations) {
  RegionMesh work = to_cgal(surface);
  for (int level = finest_level(fine); level >= 0; --level) {
    const auto faces = faces_where(
        work.mesh, [&](Mesh::Face_index face) { return !claimed(work.mesh, face, level + 1, edge_mm, fine); });
    remesh_faces(work, faces, edge_mm / std::exp2(level), iterations);
  }
  return cleaned(work, surface.region.size() > 0);
}

Surface refine(const Surface& surface, double edge_mm, const std::vector<FinePlace>& fine) {
  RegionMesh work = to_cgal(surface);
  for (int level = 1; level <= finest_level(fine); ++level) {
    const auto faces =
        faces_where(work.mesh, [&](Mesh::Face_index face) { return claimed(work.mesh, face, level, edge_mm, fine); });
    remesh_faces(work, faces, edge_mm / std::exp2(level), 5);
  }
  return cleaned(work, surface.region.size() > 0);
}

}  // namespace supine::meshing
