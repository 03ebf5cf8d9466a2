// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/fairing.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"
#include "reconstruction/surface_tree.h"
#include "reconstruction/voxel_surface.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using segmentation::Tissue;

struct Fit {
  double position_rms_mm = 0, normal_rms_deg = 0, area_ratio = 0, volume_ratio = 0;
};

// How well a voxelised ball comes back as a ball.
Fit fit_ball(double radius_mm, double voxel_mm, bool faired) {
  const auto grid = testing::cubic_grid(Eigen::Vector3d::Constant(radius_mm), voxel_mm);
  const auto image = testing::voxelise(
      grid, [=](const Eigen::Vector3d& at) { return at.norm() < radius_mm ? Tissue::adipose : Tissue::air; });
  Surface surface = voxel_surface(image, meshed_tissues()).surface;
  FairingOptions options;
  options.spacing_mm = grid.spacing_mm;
  options.length_mm = 0.75 * voxel_mm;
  if (faired) surface.points = fair(surface, options);
  surface = to_patient(surface, grid);
  const Points normals = point_normals(surface.points, surface.triangles);
  Fit fit;
  for (Eigen::Index p = 0; p < normals.rows(); ++p) {
    fit.position_rms_mm += std::pow(surface.points.row(p).norm() - radius_mm, 2);
    const Eigen::RowVector3d out = surface.points.row(p).normalized();
    fit.normal_rms_deg += std::pow(std::atan2(normals.row(p).cross(out).norm(), normals.row(p).dot(out)), 2);
  }
  fit.position_rms_mm = std::sqrt(fit.position_rms_mm / static_cast<double>(normals.rows()));
  fit.normal_rms_deg = std::sqrt(fit.normal_rms_deg / static_cast<double>(normals.rows())) * 180 / std::numbers::pi;
  const SurfaceReport report = check_surface(surface);
  fit.area_ratio = report.area_mm2 / (4 * std::numbers::pi * radius_mm * radius_mm);
  fit.volume_ratio = report.volume_mm3 / (4.0 / 3 * std::numbers::pi * std::pow(radius_mm, 3));
  return fit;
}

TEST(Fairing, StaircaseOfABallIsGone) {
  const Fit before = fit_ball(40, 1.5, false), after = fit_ball(40, 1.5, true);
  EXPECT_GT(before.normal_rms_deg, 12);
  EXPECT_NEAR(before.area_ratio, 1.088, 0.005);
  EXPECT_LT(after.normal_rms_deg, 1.6);
  EXPECT_LT(after.position_rms_mm, 0.07);  // a twentieth of a voxel
  EXPECT_NEAR(after.area_ratio, 1, 0.002);
  EXPECT_NEAR(after.volume_ratio, 1, 0.002);
}

TEST(Fairing, ScalesWithTheVoxels) {
  const Fit coarse = fit_ball(40, 1.5, true), fine = fit_ball(4, 0.15, true);
  EXPECT_NEAR(fine.position_rms_mm * 10, coarse.position_rms_mm, 1e-6);
  EXPECT_NEAR(fine.normal_rms_deg, coarse.normal_rms_deg, 1e-4);
}

TEST(Fairing, NoLengthChangesNothing) {
  Surface surface = testing::ball(10, 2);
  EXPECT_EQ(fair(surface, {.length_mm = 0, .spacing_mm = Eigen::Vector3d::Ones()}), surface.points);
}

TEST(Fairing, BoxKeepsItsEdgesWhereRegionsMeet) {
  const auto grid = testing::cubic_grid(Eigen::Vector3d(20, 12, 12), 1);
  const auto image = testing::voxelise(grid, [](const Eigen::Vector3d& at) {
    return std::abs(at.x()) < 20 && std::hypot(at.y(), at.z()) < 12 ? Tissue::adipose : Tissue::air;
  });
  Surface surface = voxel_surface(image, meshed_tissues()).surface;
  surface.region.resize(surface.triangles.rows());
  const Surface placed = to_patient(surface, grid);
  for (Eigen::Index t = 0; t < surface.region.size(); ++t) {
    const Eigen::RowVector3d middle =
        (placed.points.row(placed.triangles(t, 0)) + placed.points.row(placed.triangles(t, 1)) +
         placed.points.row(placed.triangles(t, 2))) /
        3;
    surface.region(t) = static_cast<int>(std::abs(middle.x()) > 19.2 ? Region::cut : Region::skin);
  }
  const auto missed_edge_mm = [&](bool with_regions) {  // mean distance of the true edge from the surface
    Surface work = surface;
    if (!with_regions) work.region.resize(0);
    work.points = fair(work, {.length_mm = 2, .spacing_mm = grid.spacing_mm});
    Points edge(200, 3);
    for (int i = 0; i < 200; ++i) {
      const double angle = 2 * std::numbers::pi * (i % 100) / 100;
      edge.row(i) << (i < 100 ? 20 : -20), 12 * std::cos(angle), 12 * std::sin(angle);
    }
    return SurfaceTree(to_patient(work, grid)).distances_mm(edge).mean();
  };
  EXPECT_LT(missed_edge_mm(true), 0.65);  // where the edge lies between the voxels is not known
  EXPECT_LT(missed_edge_mm(true), 0.6 * missed_edge_mm(false));
}

TEST(Fairing, SameForAnyNumberOfThreads) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const Fit one = fit_ball(60, 0.9, true);
  omp_set_num_threads(3);
  const Fit three = fit_ball(60, 0.9, true);
  omp_set_num_threads(before);
  EXPECT_EQ(one.position_rms_mm, three.position_rms_mm);
  EXPECT_EQ(one.normal_rms_deg, three.normal_rms_deg);
}

}  // namespace
}  // namespace supine::reconstruction
