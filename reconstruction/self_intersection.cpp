// SPDX-License-Identifier: AGPL-3.0-or-later
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>

#include "reconstruction/surface_check.h"

namespace supine::reconstruction {

std::vector<std::pair<int, int>> self_intersections(const Surface& surface) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  Mesh mesh;
  mesh.reserve(surface.points.rows(), 3 * surface.triangles.rows() / 2, surface.triangles.rows());
  for (Eigen::Index p = 0; p < surface.points.rows(); ++p)
    mesh.add_vertex(Kernel::Point_3(surface.points(p, 0), surface.points(p, 1), surface.points(p, 2)));
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    mesh.add_face(Mesh::Vertex_index(surface.triangles(t, 0)), Mesh::Vertex_index(surface.triangles(t, 1)),
                  Mesh::Vertex_index(surface.triangles(t, 2)));
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> found;
  CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(found));
  std::vector<std::pair<int, int>> pairs;
  for (const auto& [a, b] : found) {
    const int i = static_cast<int>(a), j = static_cast<int>(b);
    pairs.emplace_back(std::min(i, j), std::max(i, j));
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace supine::reconstruction
