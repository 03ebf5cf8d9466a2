// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/surface_distance.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "calibration/closest_point.h"
#include "calibration/point_cloud.h"
#include "calibration/surface_topology.h"
#include "common/error.h"

namespace supine::calibration {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Iterator = std::vector<Kernel::Triangle_3>::const_iterator;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

constexpr int least_cloud = PointCloud::neighbours + 1;
constexpr double least_height_share = 1e-10;  // of the longest edge: flatter triangles have no usable normal

Kernel::Point_3 cgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

void check_finite(const Points& points) {
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!points.row(i).allFinite()) throw InputError(fmt::format("point {} of the surface is not finite", i));
  }
}

void check(const Points& points, const Triangles& triangles) {
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    if (triangles.row(t).minCoeff() < 0 || triangles.row(t).maxCoeff() >= points.rows()) {
      throw InputError(fmt::format("triangle {} of the surface names a point outside 0..{}", t, points.rows() - 1));
    }
  }
  if (triangles.rows() == 0 && points.rows() < least_cloud) {
    throw InputError(
        fmt::format("a surface of {} bare points; local fits need at least {}", points.rows(), least_cloud));
  }
}

}  // namespace

void ClosestPoints::resize(Eigen::Index queries) {
  point.resize(queries, 3);
  distance_mm.resize(queries);
  triangle.resize(queries);
  node.resize(queries, 3);
  weight.resize(queries, 3);
  normal.resize(queries, 3);
  on_border.resize(queries);
}

struct SurfaceDistance::State {
  Points points;
  Triangles triangles;
  SurfaceTopology topology;
  Points face_normal;    // zero where a triangle has no area
  Points vertex_normal;  // per point; points at one place have the same
  Eigen::VectorXd area_mm2;
  std::vector<Kernel::Triangle_3> solid;  // the triangles with an area, and
  std::vector<int> row_of_solid;          // their rows
  std::optional<Tree> tree;
  std::optional<PointCloud> cloud;

  void compute_normals();
  void build_tree();
  Eigen::Vector3d corner(int triangle, int k) const { return points.row(triangles(triangle, k)); }
  TrianglePoint on(int triangle, const Eigen::Vector3d& query) const {
    return closest_on_triangle(query, corner(triangle, 0), corner(triangle, 1), corner(triangle, 2));
  }
  bool solid_triangle(int triangle) const { return !face_normal.row(triangle).isZero(0); }
  int lowest_sharing(int triangle, const TrianglePoint& at) const;
  Eigen::Vector3d pseudo_normal(int triangle, const TrianglePoint& at) const;
  bool border(int triangle, const TrianglePoint& at) const;
  void closest_triangle(const Eigen::Vector3d& query, Eigen::Index row, ClosestPoints& result) const;
  void closest_cloud(const Eigen::Vector3d& query, Eigen::Index row, ClosestPoints& result) const;
};

void SurfaceDistance::State::compute_normals() {
  const Eigen::Index count = triangles.rows();
  face_normal.setZero(count, 3);
  area_mm2.setZero(count);
  vertex_normal.setZero(points.rows(), 3);
  for (int t = 0; t < count; ++t) {
    const Eigen::Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    const Eigen::Vector3d cross = (b - a).cross(c - a);
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    area_mm2[t] = cross.norm() / 2;
    if (cross.norm() <= least_height_share * longest * longest) continue;
    face_normal.row(t) = cross.normalized();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d u = corner(t, (k + 1) % 3) - corner(t, k), v = corner(t, (k + 2) % 3) - corner(t, k);
      const double angle = std::atan2(u.cross(v).norm(), u.dot(v));
      vertex_normal.row(topology.vertex()(t, k)) += angle * face_normal.row(t);
    }
  }
  // A vertex is the lowest of the points at its place, so its row is final before the others copy it.
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    vertex_normal.row(i) = vertex_normal.row(topology.vertex_of_point()[i]).normalized();
  }
}

void SurfaceDistance::State::build_tree() {
  solid.clear();
  row_of_solid.clear();
  for (int t = 0; t < triangles.rows(); ++t) {
    if (!solid_triangle(t)) continue;
    solid.emplace_back(cgal(corner(t, 0)), cgal(corner(t, 1)), cgal(corner(t, 2)));
    row_of_solid.push_back(t);
  }
  if (solid.empty()) throw InputError(fmt::format("none of the {} triangles has an area", triangles.rows()));
  tree.emplace(solid.cbegin(), solid.cend());
  tree->build();
  tree->accelerate_distance_queries();
  tree->closest_point(cgal(corner(row_of_solid[0], 0)));  // builds what CGAL would build inside the parallel loop
}

int SurfaceDistance::State::lowest_sharing(int triangle, const TrianglePoint& at) const {
  if (at.feature == Feature::face) return triangle;
  const auto around = at.feature == Feature::edge ? topology.around_edge(triangle, at.corner)
                                                  : topology.around_vertex(triangle, at.corner);
  for (const int t : around) {
    if (solid_triangle(t)) return t;
  }
  return triangle;
}

Eigen::Vector3d SurfaceDistance::State::pseudo_normal(int triangle, const TrianglePoint& at) const {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  if (at.feature == Feature::edge) {
    for (const int t : topology.around_edge(triangle, at.corner)) normal += face_normal.row(t);
  } else if (at.feature == Feature::vertex) {
    normal = vertex_normal.row(triangles(triangle, at.corner));
  }
  // Faces folded onto each other leave nothing: the face's own normal is as good as any.
  if (normal.squaredNorm() < 1e-20) normal = face_normal.row(triangle);
  return normal.normalized();
}

bool SurfaceDistance::State::border(int triangle, const TrianglePoint& at) const {
  if (at.feature == Feature::edge) return topology.border_edge(triangle, at.corner);
  return at.feature == Feature::vertex && topology.border_vertex(triangle, at.corner);
}

void SurfaceDistance::State::closest_triangle(const Eigen::Vector3d& query, Eigen::Index row,
                                              ClosestPoints& result) const {
  int t = row_of_solid[tree->closest_point_and_primitive(cgal(query)).second - solid.cbegin()];
  TrianglePoint at = on(t, query);
  if (const int lowest = lowest_sharing(t, at); lowest != t) {
    t = lowest;
    at = on(t, query);
  }
  result.triangle[row] = t;
  result.node.row(row) = triangles.row(t);
  result.weight.row(row) = at.weight;
  result.point.row(row) = at.weight[0] * corner(t, 0) + at.weight[1] * corner(t, 1) + at.weight[2] * corner(t, 2);
  result.normal.row(row) = pseudo_normal(t, at);
  result.on_border[row] = border(t, at);
}

void SurfaceDistance::State::closest_cloud(const Eigen::Vector3d& query, Eigen::Index row,
                                           ClosestPoints& result) const {
  const PointCloud::Hit hit = cloud->closest(query);
  result.triangle[row] = -1;
  result.node.row(row).setConstant(hit.point);
  result.weight.row(row) << 1, 0, 0;
  result.point.row(row) = hit.closest;
  result.normal.row(row) = cloud->normals().row(hit.point);
  result.on_border[row] = hit.beyond_border;
}

SurfaceDistance::SurfaceDistance(const Points& points, const Triangles& triangles) : state_(std::make_unique<State>()) {
  check(points, triangles);
  state_->triangles = triangles;
  check_finite(points);  // before points are sorted by place
  if (triangles.rows() > 0) state_->topology = SurfaceTopology(points, triangles);
  move(points);
}

SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;

void SurfaceDistance::move(const Points& points) {
  check_finite(points);
  state_->points = points;
  if (is_cloud()) {
    state_->cloud.emplace(points);
  } else {
    state_->compute_normals();
    state_->build_tree();
  }
}

void SurfaceDistance::closest(const Points& queries, ClosestPoints& result) const {
  result.resize(queries.rows());
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index i = 0; i < queries.rows(); ++i) {
    if (is_cloud()) {
      state_->closest_cloud(queries.row(i), i, result);
    } else {
      state_->closest_triangle(queries.row(i), i, result);
    }
    result.distance_mm[i] = (queries.row(i) - result.point.row(i)).norm();
  }
}

bool SurfaceDistance::is_cloud() const { return state_->triangles.rows() == 0; }
bool SurfaceDistance::is_contour() const { return is_cloud() && state_->cloud->is_contour(); }
const Points& SurfaceDistance::points() const { return state_->points; }
const Triangles& SurfaceDistance::triangles() const { return state_->triangles; }
const Points& SurfaceDistance::normals() const { return is_cloud() ? state_->cloud->normals() : state_->vertex_normal; }
const Eigen::VectorXd& SurfaceDistance::areas_mm2() const { return state_->area_mm2; }

}  // namespace supine::calibration
