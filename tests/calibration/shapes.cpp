// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/calibration/shapes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace supine::testing {
namespace {

struct Growing {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;
};

Growing icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Growing s;
  s.points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
              {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  s.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return s;
}

Growing split(const Growing& in) {
  Growing out{in.points, {}};
  std::map<std::pair<int, int>, int> middle;
  const auto between = [&](int a, int b) {
    const auto [entry, is_new] = middle.try_emplace(std::minmax(a, b), static_cast<int>(out.points.size()));
    if (is_new) out.points.push_back((in.points[a] + in.points[b]) / 2);
    return entry->second;
  };
  for (const auto& t : in.triangles) {
    const int ab = between(t[0], t[1]), bc = between(t[1], t[2]), ca = between(t[2], t[0]);
    out.triangles.insert(out.triangles.end(), {{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}});
  }
  return out;
}

}  // namespace

reconstruction::Surface sphere(double radius_mm, int splits, const Eigen::Vector3d& centre) {
  Growing grown = icosahedron();
  for (int i = 0; i < splits; ++i) grown = split(grown);
  reconstruction::Surface surface{Points(grown.points.size(), 3), Triangles(grown.triangles.size(), 3), {}};
  for (std::size_t i = 0; i < grown.points.size(); ++i) {
    surface.points.row(i) = centre + radius_mm * grown.points[i].normalized();
  }
  for (std::size_t t = 0; t < grown.triangles.size(); ++t) surface.triangles.row(t) = grown.triangles[t];
  return surface;
}

reconstruction::Surface sheet(double low, double high, int cells, const std::function<double(double, double)>& height) {
  const int side = cells + 1;
  reconstruction::Surface surface{Points(side * side, 3), Triangles(2 * cells * cells, 3), {}};
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const double x = low + (high - low) * i / cells, y = low + (high - low) * j / cells;
      surface.points.row(i + side * j) << x, y, height(x, y);
      if (i == cells || j == cells) continue;
      const int a = i + side * j, b = a + 1, c = a + side, d = c + 1;
      surface.triangles.row(2 * (i + cells * j)) << a, b, d;
      surface.triangles.row(2 * (i + cells * j) + 1) << a, d, c;
    }
  }
  return surface;
}

reconstruction::Surface without(const reconstruction::Surface& surface,
                                const std::function<bool(const Eigen::Vector3d&)>& drop) {
  std::vector<int> kept;
  for (int t = 0; t < surface.triangles.rows(); ++t) {
    const Eigen::Vector3d centre = surface.points(surface.triangles.row(t), Eigen::all).colwise().mean();
    if (!drop(centre)) kept.push_back(t);
  }
  return {surface.points, surface.triangles(kept, Eigen::all), {}};
}

Points contour(double low, double high, const std::function<double(double, double)>& height) {
  constexpr double along_mm = 0.5, apart_mm = 10;
  const int count = static_cast<int>((high - low) / along_mm) + 1, rows = static_cast<int>((high - low) / apart_mm) + 1;
  Points points(count * rows, 3);
  for (int p = 0; p < points.rows(); ++p) {
    const double x = low + along_mm * (p % count), y = low + apart_mm * (p / count);
    points.row(p) << x, y, height(x, y);
  }
  return points;
}

Points random_points(int count, double low, double high, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(low, high);
  Points points(count, 3);
  for (double& value : points.reshaped<Eigen::RowMajor>()) value = uniform(generator);
  return points;
}

Eigen::Matrix3d some_rotation() {
  return Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, -0.8, 0.5).normalized()).toRotationMatrix();
}

}  // namespace supine::testing
