// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/reconstruction/volumes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "common/error.h"

namespace supine::testing {

using segmentation::Grid;
using segmentation::LabelImage;
using segmentation::Tissue;

Grid cubic_grid(const Eigen::Vector3d& half_mm, double voxel_mm) {
  Grid grid;
  grid.spacing_mm.setConstant(voxel_mm);
  grid.size = (2 * half_mm / voxel_mm).array().ceil().cast<int>() + 3;
  // Off the symmetric position, so that no surface passes through voxel centres.
  grid.origin_mm = -0.5 * voxel_mm * (grid.size.cast<double>() - Eigen::Vector3d(0.63, 0.81, 0.92));
  grid.origin_mm.y() = -voxel_mm * (grid.size.y() / 2 - 0.5);  // the plane y = 0 is half-way between voxels
  return grid;
}

LabelImage voxelise(const Grid& grid, const TissueAt& tissue) {
  LabelImage image{grid, std::vector<std::uint8_t>(grid.count())};
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        image.at(i, j, k) = static_cast<std::uint8_t>(tissue(grid.point(Eigen::Vector3d(i, j, k))));
  return image;
}

Tissue dome_on_slab(const Eigen::Vector3d& at) {
  const double from_axis = std::hypot(at.x(), at.z());
  if (at.y() > 0) return at.y() < 6 && from_axis < 40 ? Tissue::muscle : Tissue::air;
  if (at.norm() < 27) return Tissue::adipose;
  return at.norm() < 30 ? Tissue::skin : Tissue::air;
}

reconstruction::Surface ball(double radius_mm, int subdivisions) {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  std::vector<Eigen::RowVector3d> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                            {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Eigen::RowVector3i> faces = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                           {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                           {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                           {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int s = 0; s < subdivisions; ++s) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, added] = middles.try_emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (added) points.push_back(0.5 * (points[a] + points[b]));
      return found->second;
    };
    std::vector<Eigen::RowVector3i> finer;
    for (const auto& f : faces) {
      const int a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      finer.insert(finer.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
    }
    faces = finer;
  }
  reconstruction::Surface surface;
  surface.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t p = 0; p < points.size(); ++p)
    surface.points.row(static_cast<Eigen::Index>(p)) = radius_mm * points[p].normalized();
  surface.triangles.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t t = 0; t < faces.size(); ++t) surface.triangles.row(static_cast<Eigen::Index>(t)) = faces[t];
  return surface;
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace supine::testing
