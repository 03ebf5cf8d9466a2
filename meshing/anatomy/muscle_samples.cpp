// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/muscle_samples.h"

#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace supine::meshing {
namespace {

using Cube = std::array<int, 3>;

Cube cube_of(const Eigen::RowVector3d& p, double edge) {
  return {static_cast<int>(std::floor(p.x() / edge)), static_cast<int>(std::floor(p.y() / edge)),
          static_cast<int>(std::floor(p.z() / edge))};
}

struct Sum {
  Eigen::RowVector3d point = Eigen::RowVector3d::Zero(), normal = Eigen::RowVector3d::Zero();
  double area = 0;
};

// Adds triangle a b c in pieces no longer than the cubes, each at its centroid.
void add_triangle(std::map<Cube, Sum>& sums, const Eigen::RowVector3d& a, const Eigen::RowVector3d& b,
                  const Eigen::RowVector3d& c, const Eigen::RowVector3d& corner, double edge) {
  const Eigen::RowVector3d u = b - a, v = c - a, cross = u.cross(v);
  const int n = std::clamp(static_cast<int>(std::ceil(std::max({u.norm(), v.norm(), (c - b).norm()}) / edge)), 1, 200);
  const double area = cross.norm() / 2 / (n * n);
  if (area == 0) return;
  const auto add = [&](double s, double t) {
    const Eigen::RowVector3d p = a + s / n * u + t / n * v;
    Sum& sum = sums[cube_of(p - corner, edge)];
    sum.point += area * p;
    sum.normal += area * cross.normalized();
    sum.area += area;
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      add(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j + 1 < n) add(i + 2.0 / 3, j + 2.0 / 3);
    }
  }
}

// Looks up samples by the cube they are in.
class Neighbours {
 public:
  Neighbours(const Points& points, double edge) : points_(points), edge_(edge) {
    for (int i = 0; i < points.rows(); ++i) cubes_[cube_of(points.row(i), edge)].push_back(i);
  }

  template <class Visit>
  void within(const Eigen::RowVector3d& p, double radius, const Visit& visit) const {
    const Eigen::RowVector3d r = Eigen::RowVector3d::Constant(radius);
    const Cube low = cube_of(p - r, edge_), high = cube_of(p + r, edge_);
    for (int i = low[0]; i <= high[0]; ++i) {
      for (int j = low[1]; j <= high[1]; ++j) {
        for (int k = low[2]; k <= high[2]; ++k) {
          const auto found = cubes_.find({i, j, k});
          if (found == cubes_.end()) continue;
          for (const int s : found->second) {
            const double squared = (points_.row(s) - p).squaredNorm();
            if (squared <= radius * radius) visit(s, squared);
          }
        }
      }
    }
  }

 private:
  const Points& points_;
  double edge_;
  std::map<Cube, std::vector<int>> cubes_;
};

// Distance from a point to the nearest sample.
class Nearest {
 public:
  explicit Nearest(const Points& points) {
    for (Eigen::Index i = 0; i < points.rows(); ++i) tree_.insert({points(i, 0), points(i, 1), points(i, 2)});
    tree_.build();
  }
  double distance_mm(const Eigen::RowVector3d& p) const {
    Search search(tree_, {p.x(), p.y(), p.z()}, 1);
    return std::sqrt(search.begin()->second);
  }

 private:
  using Search = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<CGAL::Simple_cartesian<double>>>;
  Search::Tree tree_;
};

}  // namespace

SheetSamples sample_sheet(const reconstruction::Surface& sheet, double spacing_mm, double smooth_mm) {
  std::map<Cube, Sum> sums;
  const Eigen::RowVector3d corner = sheet.points.colwise().minCoeff();
  for (Eigen::Index t = 0; t < sheet.triangles.rows(); ++t) {
    const auto tri = sheet.triangles.row(t);
    add_triangle(sums, sheet.points.row(tri[0]), sheet.points.row(tri[1]), sheet.points.row(tri[2]), corner,
                 spacing_mm);
  }
  const auto count = static_cast<Eigen::Index>(sums.size());
  SheetSamples out{Points(count, 3), Points(count, 3), Eigen::VectorXd(count)};
  Points rough(count, 3);
  Eigen::Index i = 0;
  for (const auto& [cube, sum] : sums) {
    out.points.row(i) = sum.point / sum.area;
    out.area_mm2[i] = sum.area;
    rough.row(i++) = sum.normal;
  }
  const Neighbours neighbours(out.points, 2 * smooth_mm);
  for (i = 0; i < count; ++i) {
    Eigen::RowVector3d normal = Eigen::RowVector3d::Zero();
    neighbours.within(out.points.row(i), 2.5 * smooth_mm, [&](int s, double squared) {
      normal += std::exp(-squared / (2 * smooth_mm * smooth_mm)) * rough.row(s);
    });
    out.normals.row(i) = normal.normalized();
  }
  return out;
}

DistanceSamples offset_samples(const SheetSamples& sheet, double highest_mm) {
  struct Offset {
    double mm, weight;
  };
  // Dense where the interface works, sparse higher up, where only the thickness of the breast is read off.
  const std::array<Offset, 10> offsets = {
      {{0, 1}, {4, 0.5}, {8, 0.5}, {15, 0.5}, {30, 0.2}, {50, 0.1}, {75, 0.1}, {-4, 0.5}, {-8, 0.5}, {-15, 0.3}}};
  constexpr double nearer = 0.93;  // a sample closer than this share of |d|: the offset belongs to another place
  const Nearest nearest(sheet.points);
  std::vector<Eigen::RowVector3d> points;
  std::vector<double> distance, weight;
  for (Eigen::Index i = 0; i < sheet.points.rows(); ++i) {
    for (const Offset& o : offsets) {
      if (o.mm > highest_mm) continue;
      const Eigen::RowVector3d p = sheet.points.row(i) + o.mm * sheet.normals.row(i);
      if (o.mm != 0 && nearest.distance_mm(p) < nearer * std::abs(o.mm)) continue;
      points.push_back(p);
      distance.push_back(o.mm);
      weight.push_back(o.weight * sheet.area_mm2[i]);
    }
  }
  const auto count = static_cast<Eigen::Index>(points.size());
  DistanceSamples out{Points(count, 3), Eigen::Map<Eigen::VectorXd>(distance.data(), count),
                      Eigen::Map<Eigen::VectorXd>(weight.data(), count)};
  for (Eigen::Index i = 0; i < count; ++i) out.points.row(i) = points[i];
  return out;
}

}  // namespace supine::meshing
