// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/surface_tree.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <cmath>
#include <vector>

namespace supine::reconstruction {

namespace {
using Kernel = CGAL::Simple_cartesian<double>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>;
using AabbTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
}  // namespace

struct SurfaceTree::Tree {
  std::vector<Kernel::Triangle_3> triangles;
  AabbTree tree;
};

SurfaceTree::SurfaceTree(const Surface& surface) : tree_(std::make_unique<Tree>()) {
  const auto point = [&surface](int p) {
    return Kernel::Point_3(surface.points(p, 0), surface.points(p, 1), surface.points(p, 2));
  };
  tree_->triangles.reserve(surface.triangles.rows());
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Kernel::Triangle_3 triangle(point(surface.triangles(t, 0)), point(surface.triangles(t, 1)),
                                      point(surface.triangles(t, 2)));
    if (!triangle.is_degenerate()) tree_->triangles.push_back(triangle);
  }
  tree_->tree.insert(tree_->triangles.cbegin(), tree_->triangles.cend());
  tree_->tree.accelerate_distance_queries();
}

SurfaceTree::~SurfaceTree() = default;

Eigen::VectorXd SurfaceTree::distances_mm(const Points& points) const {
  Eigen::VectorXd result(points.rows());
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index p = 0; p < points.rows(); ++p)
    result(p) = std::sqrt(tree_->tree.squared_distance(Kernel::Point_3(points(p, 0), points(p, 1), points(p, 2))));
  return result;
}

}  // namespace supine::reconstruction
