// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/shaping.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <random>
#include <set>

#include "reconstruction/surface_check.h"
#include "tests/reconstruction/volumes.h"

// Organs that touch: the same vertices on either side.
namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;
using testing::voxelise;

/// A ball of gland cut by x = 3 from a ball part of tumour, a ball of nipple inside the gland, and a vessel apart.
Tissue touching(const Eigen::Vector3d& at) {
  if ((at - Eigen::Vector3d(-9, 1, 0)).norm() < 4) return Tissue::nipple;
  if (at.norm() < 17) return at.x() < 3 ? Tissue::gland : Tissue::tumour;
  if ((at - Eigen::Vector3d(30, 0, 0)).norm() < 6) return Tissue::vessel;
  return Tissue::air;
}

LabelImage labels() { return voxelise(testing::cubic_grid(Eigen::Vector3d(38, 20, 20), 1), touching); }

using Point = std::array<double, 3>;
std::set<Point> point_set(const Surface& surface) {
  std::set<Point> result;
  for (const auto& p : surface.points.rowwise()) result.insert({p(0), p(1), p(2)});
  return result;
}

/// Faces between a voxel of one tissue and one of the other.
std::size_t faces_between(const LabelImage& image, Tissue one, Tissue other) {
  std::size_t count = 0;
  const auto is = [&](int i, int j, int k, Tissue t) { return static_cast<Tissue>(image.at(i, j, k)) == t; };
  for (int k = 0; k + 1 < image.grid.size.z(); ++k)
    for (int j = 0; j + 1 < image.grid.size.y(); ++j)
      for (int i = 0; i + 1 < image.grid.size.x(); ++i)
        for (const auto& [di, dj, dk] : {std::array{1, 0, 0}, {0, 1, 0}, {0, 0, 1}})
          count += (is(i, j, k, one) && is(i + di, j + dj, k + dk, other)) ||
                   (is(i, j, k, other) && is(i + di, j + dj, k + dk, one));
  return count;
}

struct Shaped {
  std::vector<VoxelSurface> voxels;
  std::vector<ShapedSurface> surfaces;
};

Shaped shaped(const LabelImage& image, const std::vector<Tissue>& tissues) {
  Shaped result;
  std::vector<const VoxelSurface*> all;
  for (const Tissue tissue : tissues) result.voxels.push_back(voxel_surface(image, only(tissue)));
  for (const VoxelSurface& voxels : result.voxels) all.push_back(&voxels);
  result.surfaces = shape_together(all, {image.grid.spacing_mm, 0.75});
  return result;
}

TEST(Shaping, TouchingSurfacesHaveTheVerticesOfTheirInterfaceInCommon) {
  LabelImage image = labels();
  image.grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  image.grid.direction.col(2) *= -1;  // left-handed
  const std::vector<Tissue> tissues = {Tissue::gland, Tissue::tumour, Tissue::nipple};
  const Shaped all = shaped(image, tissues);
  std::vector<std::set<Point>> points;
  for (const ShapedSurface& one : all.surfaces) points.push_back(point_set(to_patient(one.surface, image.grid)));
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = a + 1; b < 3; ++b) {
      std::vector<Point> common;
      std::set_intersection(points[a].begin(), points[a].end(), points[b].begin(), points[b].end(),
                            std::back_inserter(common));
      EXPECT_EQ(common.size(), faces_between(image, tissues[a], tissues[b])) << a << " " << b;
    }
  EXPECT_GT(faces_between(image, Tissue::gland, Tissue::tumour), 800u);
  EXPECT_EQ(faces_between(image, Tissue::tumour, Tissue::nipple), 0u);
}

TEST(Shaping, TouchingSurfacesKeepTheirVolumesAndAreSound) {
  const Shaped all = shaped(labels(), {Tissue::gland, Tissue::tumour, Tissue::nipple});
  for (std::size_t n = 0; n < all.surfaces.size(); ++n) {
    const SurfaceReport report = check_surface(all.surfaces[n].surface);
    EXPECT_TRUE(report.closed() && report.manifold()) << n;
    EXPECT_TRUE(self_intersections(all.surfaces[n].surface).empty()) << n;
    EXPECT_NEAR(report.volume_mm3 / all.voxels[n].voxel_volume_mm3(), 1, 0.003) << n;
  }
}

TEST(Shaping, TheCommonFaceIsFlatAndTheBallWithinRound) {
  // The cut x = 3 lies between two layers of voxels: the points of the common face, its rim left out, stay in a plane.
  const Shaped all = shaped(labels(), {Tissue::gland, Tissue::tumour, Tissue::nipple});
  const Points& start = all.voxels[1].surface.points;
  const Points& tumour = all.surfaces[1].surface.points;
  const Eigen::RowVector3d middle = start.colwise().mean();
  const double face_x = start.col(0).minCoeff();
  std::vector<double> x;
  for (Eigen::Index p = 0; p < tumour.rows(); ++p)
    if (start(p, 0) < face_x + 0.1 && (start.row(p) - middle).tail<2>().norm() < 11) x.push_back(tumour(p, 0));
  ASSERT_GT(x.size(), 300u);
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  EXPECT_LT(*high - *low, 0.15);
  EXPECT_NEAR(0.5 * (*low + *high), face_x, 0.25);  // it moves for the tumour's volume
  const Points& nipple = all.surfaces[2].surface.points;
  const Eigen::VectorXd radius = (nipple.rowwise() - nipple.colwise().mean()).rowwise().norm();
  EXPECT_LT(std::sqrt((radius.array() - radius.mean()).square().mean()), 0.1);
}

TEST(Shaping, BitsOfSingleVoxelsAreNotTurnedInsideOut) {
  std::mt19937 random(5);
  LabelImage image;
  image.grid.size = {16, 16, 16};
  constexpr Tissue any[] = {Tissue::gland, Tissue::tumour, Tissue::vessel, Tissue::air, Tissue::air};
  for (std::size_t n = 0; n < image.grid.count(); ++n)
    image.voxels.push_back(static_cast<std::uint8_t>(any[random() % std::size(any)]));
  const Shaped all = shaped(image, {Tissue::gland, Tissue::tumour, Tissue::vessel});
  for (std::size_t n = 0; n < 3; ++n) {
    const Surface& surface = all.surfaces[n].surface;
    const std::vector<int> component = triangle_components(surface.triangles);
    const std::vector<double> before = component_volumes(all.voxels[n].surface, component),
                              after = component_volumes(surface, component);
    EXPECT_GT(before.size(), 50u);
    for (std::size_t c = 0; c < before.size(); ++c) EXPECT_GT(before[c] * after[c], 0) << n << " " << c;
    EXPECT_TRUE(self_intersections(surface).empty()) << n;
  }
}

TEST(Shaping, GroupsAreThoseThatTouch) {
  const LabelImage image = labels();
  std::vector<VoxelSurface> voxels;
  for (const Tissue tissue : {Tissue::gland, Tissue::vessel, Tissue::tumour, Tissue::nipple})
    voxels.push_back(voxel_surface(image, only(tissue)));
  EXPECT_EQ(touching_groups({&voxels[0], &voxels[1], &voxels[2], &voxels[3]}),
            (std::vector<std::vector<int>>{{0, 2, 3}, {1}}));
  EXPECT_EQ(touching_groups({&voxels[2], &voxels[3], &voxels[0]}), (std::vector<std::vector<int>>{{0, 1, 2}}));
  EXPECT_TRUE(touching_groups({}).empty());
}

}  // namespace
}  // namespace supine::reconstruction
