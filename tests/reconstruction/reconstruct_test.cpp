// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/reconstruct.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "reconstruction/mesh_edges.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using segmentation::Grid;
using segmentation::LabelImage;
using segmentation::Tissue;
using testing::message_of;
using testing::voxelise;

constexpr double volume_bound = 0.003;  // aimed at; 0.01 is promised

// The dome with a gland ball and a tumour ball that touches it.
Tissue dome_with_organs(const Eigen::Vector3d& at) {
  const Tissue tissue = testing::dome_on_slab(at);
  if (tissue != Tissue::adipose) return tissue;
  if ((at - Eigen::Vector3d(-4, -13, 0)).norm() < 9) return Tissue::gland;
  if ((at - Eigen::Vector3d(8, -13, 0)).norm() < 5) return Tissue::tumour;
  return tissue;
}

Grid dome_grid(double voxel_mm = 1.5) { return testing::cubic_grid(Eigen::Vector3d(44, 36, 44), voxel_mm); }

void expect_sound(const OrganSurface& organ) {
  EXPECT_TRUE(organ.report.closed()) << organ.name;
  EXPECT_TRUE(organ.report.manifold()) << organ.name;
  EXPECT_EQ(organ.report.components - organ.report.cavities, organ.voxel_components) << organ.name;
  EXPECT_LT(std::abs(organ.volume_error()), volume_bound) << organ.name;
  EXPECT_TRUE(self_intersections(organ.surface).empty()) << organ.name;
}

double area(const Reconstruction& shape, Region region) {
  return shape.breast.report.region_area_mm2[static_cast<int>(region)];
}

TEST(Reconstruct, DomeOnASlabWithTwoTouchingOrgans) {
  const Reconstruction shape = reconstruct(voxelise(dome_grid(), dome_with_organs), {});
  expect_sound(shape.breast);
  EXPECT_EQ(shape.breast.report.genus(), 0);
  ASSERT_EQ(shape.organs.size(), 2);
  EXPECT_EQ(shape.organs[0].name, "gland");
  EXPECT_EQ(shape.organs[1].name, "tumour");
  for (const OrganSurface& organ : shape.organs) expect_sound(organ);
  EXPECT_NEAR(area(shape, Region::skin) / (2 * std::numbers::pi * 900), 1, 0.02);
  EXPECT_NEAR(area(shape, Region::inner) / (std::numbers::pi * 900), 1, 0.03);
  EXPECT_EQ(area(shape, Region::cut), 0);
}

TEST(Reconstruct, TouchingOrgansShareTheirVertices) {
  const LabelImage image = voxelise(dome_grid(0.75), [](const Eigen::Vector3d& at) {  // the two balls overlap
    return dome_with_organs(at.x() > 0 ? at + Eigen::Vector3d(3, 0, 0) : at);
  });
  const Reconstruction shape = reconstruct(image, {});
  ASSERT_EQ(shape.organs.size(), 2);
  for (const OrganSurface& organ : shape.organs) expect_sound(organ);
  std::set<std::array<double, 3>> gland;
  for (const auto& p : shape.organs[0].surface.points.rowwise()) gland.insert({p(0), p(1), p(2)});
  std::size_t common = 0, faces = 0;
  for (const auto& p : shape.organs[1].surface.points.rowwise()) common += gland.count({p(0), p(1), p(2)});
  const VoxelSurface tumour = voxel_surface(image, only(Tissue::tumour));
  for (const auto& v : tumour.outside.rowwise())
    faces += static_cast<Tissue>(image.at(v(0), v(1), v(2))) == Tissue::gland;
  EXPECT_GT(faces, 50u);
  EXPECT_EQ(common, faces);
}

TEST(Reconstruct, MuscleSheetIsTheInnerFacesTurnedRound) {
  const Reconstruction shape = reconstruct(voxelise(dome_grid(), testing::dome_on_slab), {});
  const SurfaceReport sheet = check_surface(shape.muscle);
  EXPECT_DOUBLE_EQ(sheet.area_mm2, area(shape, Region::inner));
  EXPECT_EQ(sheet.components, 1);
  EXPECT_TRUE(sheet.manifold());
  EXPECT_GT(sheet.border_edges, 0);
  const Points normals = point_normals(shape.muscle.points, shape.muscle.triangles);
  EXPECT_LT(normals.col(1).mean(), -0.97) << "the breast lies toward −y";
  // The slab ends at y = 0; the staircase of the rim does not bend the sheet up.
  EXPECT_LT(shape.muscle.points.col(1).cwiseAbs().maxCoeff(), 1.0);
}

TEST(Reconstruct, RegionBorderIsTheRimOfTheDome) {
  const Reconstruction shape = reconstruct(voxelise(dome_grid(), testing::dome_on_slab), {});
  const Surface& breast = shape.breast.surface;
  int points = 0;
  for (const MeshEdge& edge : mesh_edges(breast.triangles)) {
    if (breast.region(edge.triangles[0]) == breast.region(edge.triangles[1])) continue;
    const auto at = breast.points.row(edge.points[0]);
    EXPECT_NEAR(std::hypot(at.x(), at.z()), 30, 1.5);
    EXPECT_NEAR(at.y(), 0, 1.5);
    ++points;
  }
  EXPECT_GT(points, 100);
}

TEST(Reconstruct, ObliqueAndLeftHandedImagesGiveTheSameBody) {
  const Reconstruction straight = reconstruct(voxelise(dome_grid(), dome_with_organs), {});
  for (const double mirror : {1.0, -1.0}) {
    Grid grid = dome_grid();
    grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(2, -1, 1).normalized()).toRotationMatrix() *
                     Eigen::Vector3d(1, 1, mirror).asDiagonal();
    grid.size.array() += 20;
    grid.origin_mm = -grid.direction * (0.5 * grid.spacing_mm.cwiseProduct(grid.size.cast<double>()));
    const Reconstruction turned = reconstruct(voxelise(grid, dome_with_organs), {});
    expect_sound(turned.breast);
    EXPECT_NEAR(turned.breast.report.volume_mm3 / straight.breast.report.volume_mm3, 1, 0.01);
    for (const Region region : {Region::inner, Region::skin})
      EXPECT_NEAR(area(turned, region) / area(straight, region), 1, 0.03) << region_names[static_cast<int>(region)];
  }
}

TEST(Reconstruct, FlatVoxelsAndThinShell) {
  Grid flat = dome_grid();
  flat.spacing_mm = {1, 1, 3};
  flat.size = {92, 76, 32};
  flat.origin_mm = -0.5 * flat.spacing_mm.cwiseProduct(flat.size.cast<double>());
  expect_sound(reconstruct(voxelise(flat, testing::dome_on_slab), {}).breast);
  // A shell two voxels thick with muscle inside it.
  const auto shell = [](const Eigen::Vector3d& at) {
    return at.norm() < 25 ? Tissue::muscle : at.norm() < 28 ? Tissue::skin : Tissue::air;
  };
  const Reconstruction thin = reconstruct(voxelise(testing::cubic_grid(Eigen::Vector3d::Constant(30), 1.5), shell), {});
  expect_sound(thin.breast);
  EXPECT_EQ(thin.breast.report.cavities, 1);
}

TEST(Reconstruct, TorusKeepsItsHandle) {
  const auto torus = [](const Eigen::Vector3d& at) {
    const double ring = std::hypot(std::hypot(at.x(), at.z()) - 20, at.y());
    return ring < 6 ? Tissue::adipose : at.y() > 0 && at.y() < 8 ? Tissue::muscle : Tissue::air;
  };
  const Reconstruction shape = reconstruct(voxelise(testing::cubic_grid(Eigen::Vector3d(28, 12, 28), 1), torus), {});
  expect_sound(shape.breast);
  EXPECT_EQ(shape.breast.report.genus(), 1);
}

TEST(Reconstruct, LooseBitIsLeftOutAndTwoBodiesStayTwo) {
  const auto with_ball = [](double radius_mm) {
    return [=](const Eigen::Vector3d& at) {
      return (at - Eigen::Vector3d(36, -28, 0)).norm() < radius_mm ? Tissue::adipose : testing::dome_on_slab(at);
    };
  };
  const Reconstruction bit = reconstruct(voxelise(dome_grid(), with_ball(2.5)), {});
  EXPECT_EQ(bit.breast.dropped_pieces, 1);
  EXPECT_EQ(bit.breast.report.components, 1);
  const Reconstruction two = reconstruct(voxelise(dome_grid(), with_ball(6)), {});
  EXPECT_EQ(two.breast.report.components, 2);
  expect_sound(two.breast);
}

TEST(Reconstruct, LargeOrganIsMadeFromBlocksAndKeepsItsVolume) {
  ReconstructOptions options;
  options.most_organ_triangles = 1000;
  const Reconstruction shape = reconstruct(voxelise(dome_grid(0.75), dome_with_organs), options);
  ASSERT_EQ(shape.organs[0].name, "gland");
  EXPECT_GT(shape.organs[0].voxel_mm, 0.75);
  EXPECT_LT(std::abs(shape.organs[0].volume_error()), 0.01);
}

TEST(Reconstruct, RefusesLabelsThatCannotBecomeAModel) {
  const auto all = [](Tissue tissue) {
    return voxelise(testing::cubic_grid(Eigen::Vector3d::Constant(5), 1),
                    [=](const Eigen::Vector3d&) { return tissue; });
  };
  EXPECT_NE(message_of([&] { reconstruct(all(Tissue::muscle), {}); }).find("no tissue to mesh"), std::string::npos);
  EXPECT_NE(message_of([&] { reconstruct(all(Tissue::adipose), {}); }).find("no muscle"), std::string::npos);
  const auto apart = [](const Eigen::Vector3d& at) {
    return at.norm() < 10 ? Tissue::adipose : at.y() > 13 && at.y() < 17 ? Tissue::muscle : Tissue::air;
  };
  const LabelImage image = voxelise(testing::cubic_grid(Eigen::Vector3d::Constant(20), 1), apart);
  EXPECT_NE(message_of([&] { reconstruct(image, {}); }).find("borders on the muscle"), std::string::npos);
}

TEST(Reconstruct, OptionsOutOfRangeAreNamed) {
  const auto refusal = [](auto&& change) {
    ReconstructOptions options;
    change(options);
    return message_of([&] { options.check(); });
  };
  EXPECT_NE(refusal([](auto& o) { o.smooth_mm = -1; }).find("smooth_mm is -1"), std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.cut.rim_mm = 0; }).find("rim_mm is 0"), std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.smallest_piece_mm3 = -1; }).find("smallest_piece_mm3"), std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.thinnest_mm = -1; }).find("thinnest_mm"), std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.most_organ_triangles = 5; }).find("most_organ_triangles"), std::string::npos);
}

}  // namespace
}  // namespace supine::reconstruction
