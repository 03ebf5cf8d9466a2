// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/fine_surface.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/error.h"
#include "reconstruction/mesh_edges.h"

namespace supine::meshing {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangle = Kernel::Triangle_3;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Triangle>::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
using reconstruction::Region;
using reconstruction::Surface;

constexpr double cell_mm = 4;       // of the grid that finds points around a place
constexpr double same_side = 0.75;  // cosine: points whose normals differ more lie beyond a crease, or on another sheet
// Share of the neighbourhood: a fit further off has a corner in it (a right angle in a curve gives 0.12).
constexpr double most_shift = 0.15, most_border_shift = 0.1;
constexpr int fewest_surface = 12, fewest_border = 6;  // points for a fit with 6 and 3 unknowns

/// Points with unit normals (or tangents), found by place.
class Cloud {
 public:
  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
    cells_[key(cell(point))].push_back(static_cast<int>(points_.size()));
    points_.push_back({point, direction});
  }

  template <class Visit>
  void around(const Eigen::Vector3d& at, double radius_mm, const Visit& visit) const {
    const Eigen::Vector3i low = cell(at.array() - radius_mm), high = cell(at.array() + radius_mm);
    for (int i = low.x(); i <= high.x(); ++i)
      for (int j = low.y(); j <= high.y(); ++j)
        for (int k = low.z(); k <= high.z(); ++k) {
          const auto found = cells_.find(key({i, j, k}));
          if (found == cells_.end()) continue;
          for (const int p : found->second)
            if ((points_[p].first - at).squaredNorm() <= radius_mm * radius_mm)
              visit(points_[p].first, points_[p].second);
        }
  }

 private:
  static Eigen::Vector3i cell(const Eigen::Vector3d& p) { return (p / cell_mm).array().floor().cast<int>(); }
  static long key(const Eigen::Vector3i& c) { return (c.x() * 2097152L + c.y()) * 2097152L + c.z(); }

  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> points_;
  std::unordered_map<long, std::vector<int>> cells_;
};

struct Patch {
  std::vector<Triangle> triangles;
  std::vector<Eigen::Vector3d> normals;  // of the triangles
  Tree tree;
  Cloud cloud;  // points with the patch's normals
};

struct Border {
  std::vector<std::array<Eigen::Vector3d, 2>> segments;
  Cloud cloud;  // middles of the segments with their directions
};

// Falls to zero at the edge of the neighbourhood, so that the fit changes smoothly with the place.
double weight_of(double distance, double radius) {
  const double s = 1 - distance * distance / (radius * radius);
  return s > 0 ? s * s : 0;
}

Eigen::Vector3d to_eigen(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

struct FineSurface::Parts {
  std::map<int, Patch> patches;
  std::map<std::pair<int, int>, Border> borders;

  void add_patches(const Surface& surface);
  void add_borders(const Surface& surface);
};

void FineSurface::Parts::add_patches(const Surface& surface) {
  for (const int region : {1, 2, 4}) {
    std::vector<int> rows;
    for (int t = 0; t < surface.triangles.rows(); ++t)
      if (patch_of(surface.region[t]) == region) rows.push_back(t);
    if (rows.empty()) continue;
    Patch& patch = patches[region];
    const Triangles triangles = surface.triangles(rows, Eigen::all);
    const Points normals = reconstruction::point_normals(surface.points, triangles);
    std::vector<char> used(surface.points.rows(), 0);
    for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
      std::array<Eigen::Vector3d, 3> x;
      for (int k = 0; k < 3; ++k) {
        const int p = triangles(t, k);
        x[k] = surface.points.row(p).transpose();
        if (!std::exchange(used[p], 1)) patch.cloud.add(x[k], normals.row(p).transpose());
      }
      const Eigen::Vector3d normal = (x[1] - x[0]).cross(x[2] - x[0]);
      if (!(normal.norm() > 0)) continue;
      const auto point = [&](int k) { return Kernel::Point_3(x[k].x(), x[k].y(), x[k].z()); };
      patch.triangles.emplace_back(point(0), point(1), point(2));
      patch.normals.push_back(normal.normalized());
    }
    patch.tree.insert(patch.triangles.cbegin(), patch.triangles.cend());
    patch.tree.accelerate_distance_queries();
  }
}

void FineSurface::Parts::add_borders(const Surface& surface) {
  for (const reconstruction::MeshEdge& edge : reconstruction::mesh_edges(surface.triangles)) {
    if (edge.count != 2) continue;
    const int a = patch_of(surface.region[edge.triangles[0]]), b = patch_of(surface.region[edge.triangles[1]]);
    if (a == b) continue;
    const Eigen::Vector3d from = surface.points.row(edge.points[0]), to = surface.points.row(edge.points[1]);
    if (!((to - from).norm() > 0)) continue;
    Border& border = borders[std::minmax(a, b)];
    border.segments.push_back({from, to});
    border.cloud.add((from + to) / 2, (to - from));
  }
}

int patch_of(int region) {
  return region == static_cast<int>(Region::ligament) ? static_cast<int>(Region::inner) : region;
}

FineSurface::FineSurface(const Surface& surface) : parts_(std::make_unique<Parts>()) {
  if (surface.region.size() != surface.triangles.rows() || surface.triangles.rows() < 4)
    throw InputError(fmt::format("the fine surface has {} triangles and {} regions; every triangle needs its region",
                                 surface.triangles.rows(), surface.region.size()));
  parts_->add_patches(surface);
  parts_->add_borders(surface);
}

FineSurface::~FineSurface() = default;

std::optional<Eigen::Vector3d> FineSurface::on_region(const Eigen::Vector3d& point_mm, int region,
                                                      double smooth_mm) const {
  const auto found = parts_->patches.find(patch_of(region));
  if (found == parts_->patches.end()) return std::nullopt;
  const Patch& patch = found->second;
  const auto [closest, triangle] = patch.tree.closest_point_and_primitive({point_mm.x(), point_mm.y(), point_mm.z()});
  const Eigen::Vector3d at = to_eigen(closest);
  if (!(smooth_mm > 0)) return at;
  const Eigen::Vector3d facet = patch.normals[triangle - patch.triangles.cbegin()];
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  patch.cloud.around(at, smooth_mm, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    if (n.dot(facet) > same_side) normal += weight_of((p - at).norm(), smooth_mm) * n;
  });
  if (!(normal.norm() > 0)) return at;
  normal.normalize();
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  int count = 0;
  patch.cloud.around(at, smooth_mm, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    if (n.dot(facet) <= same_side) return;
    const Eigen::Vector3d d = (p - at) / smooth_mm;
    const double s = d.dot(u), t = d.dot(v), w = weight_of(d.norm(), 1);
    const Eigen::Matrix<double, 6, 1> row = (Eigen::Matrix<double, 6, 1>() << 1, s, t, s * s, s * t, t * t).finished();
    matrix += w * row * row.transpose();
    right += w * d.dot(normal) * row;
    ++count;
  });
  if (count < fewest_surface) return at;
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> solver(matrix);
  if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-8)) return at;
  const Eigen::Matrix<double, 6, 1> c = solver.solve(right);
  if (!(std::abs(c[0]) < most_shift)) return at;
  return at + smooth_mm * c[0] * normal;
}

std::optional<Eigen::Vector3d> FineSurface::on_border(const Eigen::Vector3d& point_mm, int region, int other,
                                                      double smooth_mm) const {
  const auto found = parts_->borders.find(std::minmax(patch_of(region), patch_of(other)));
  if (found == parts_->borders.end()) return std::nullopt;
  const Border& border = found->second;
  Eigen::Vector3d at = point_mm, along = Eigen::Vector3d::Zero();
  double nearest = 1e300;
  for (const auto& [a, b] : border.segments) {
    const Eigen::Vector3d edge = b - a;
    const Eigen::Vector3d p = a + std::clamp((point_mm - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0) * edge;
    const double squared = (p - point_mm).squaredNorm();
    if (squared >= nearest) continue;
    nearest = squared;
    at = p;
    along = edge.normalized();
  }
  if (!(smooth_mm > 0)) return at;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  border.cloud.around(at, smooth_mm, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& edge) {
    const double sign = edge.dot(along) < 0 ? -1 : 1;
    direction += sign * weight_of((p - at).norm(), smooth_mm) * edge;
  });
  if (!(direction.norm() > 0)) return at;
  direction.normalize();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero(), right = Eigen::Matrix3d::Zero();
  int count = 0;
  border.cloud.around(at, smooth_mm, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& edge) {
    const Eigen::Vector3d d = (p - at) / smooth_mm;
    const double s = d.dot(direction), w = weight_of(d.norm(), 1) * edge.norm();
    const Eigen::Vector3d row(1, s, s * s);
    matrix += w * row * row.transpose();
    right += w * row * d.transpose();
    ++count;
  });
  if (count < fewest_border) return at;
  const Eigen::LDLT<Eigen::Matrix3d> solver(matrix);
  if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-8)) return at;
  const Eigen::Vector3d shift = smooth_mm * solver.solve(right).row(0).transpose();
  if (!(shift.norm() < most_border_shift * smooth_mm)) return at;
  return at + (shift - shift.dot(direction) * direction);
}

}  // namespace supine::meshing
