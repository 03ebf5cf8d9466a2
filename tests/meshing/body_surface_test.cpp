// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/body_surface.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "common/error.h"
#include "meshing/decimate/decimate.h"
#include "meshing/mesh_io.h"
#include "meshing/supports.h"
#include "meshing/tetrahedra/part_fractions.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "meshing/topology.h"
#include "reconstruction/reconstruct.h"
#include "segmentation/label_map.h"
#include "tests/pipeline/temporary_folder.h"
#include "tests/support/shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::Region;
using reconstruction::Surface;

const Eigen::Vector3d size_mm(60, 20, 20);

/// The closed surface of a block, without regions.
Surface block() {
  Surface surface = testing::boundary_surface(testing::box_mesh(6, 2, 2, size_mm));
  surface.region.resize(0);
  return surface;
}

BodyPlace plane(const std::string& name, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  return {name, point, normal, {}, 0.5, false};
}

const std::vector<BodyPlace> both_ends = {plane("near", {0, 0, 0}, {-1, 0, 0}), plane("far", {60, 0, 0}, {1, 0, 0})};

std::string complaint(const std::function<void()>& work) {
  try {
    work();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

double area_of(const Surface& surface, Region region) {
  return reconstruction::check_surface(surface).region_area_mm2[static_cast<int>(region)];
}

TEST(BodySurface, FacesOnASupportAreInnerTheOthersSkin) {
  const Surface body = with_support_regions(block(), both_ends, "block");
  EXPECT_NEAR(area_of(body, Region::inner), 2 * 400, 1e-9);
  EXPECT_NEAR(area_of(body, Region::skin), 4 * 1200, 1e-9);
}

TEST(BodySurface, BeyondTakesEveryFaceOnTheOuterSide) {
  BodyPlace box = plane("box", {40, 0, 0}, {1, 0, 0});
  box.beyond = true;
  const Surface body = with_support_regions(block(), {box}, "block");
  EXPECT_NEAR(area_of(body, Region::inner), 400 + 4 * 20 * 20, 1e-9);
}

TEST(BodySurface, ASurfaceIsASupportToo) {
  BodyPlace table;
  table.name = "table";
  table.surface = Surface{};
  table.surface->points.resize(3, 3);
  table.surface->points << -100, -0.2, -100, 300, -0.2, -100, -100, -0.2, 300;
  table.surface->triangles.resize(1, 3);
  table.surface->triangles << 0, 1, 2;
  const Surface body = with_support_regions(block(), {table}, "block");
  EXPECT_NEAR(area_of(body, Region::inner), 1200, 1e-9);
}

TEST(BodySurface, WhatCannotBeMeantIsRefusedWithPlaceAndDistance) {
  EXPECT_NE(complaint([] { with_support_regions(block(), {}, "block"); }).find("nothing holds the body"),
            std::string::npos);
  const std::string empty = complaint([] {
    with_support_regions(block(), {plane("shelf", {0, 0, 25}, {0, 0, 1})}, "block");
  });
  EXPECT_NE(empty.find("'shelf'"), std::string::npos) << empty;
  EXPECT_NE(empty.find("5.00 mm"), std::string::npos) << empty;
  const std::string twice = complaint([] {
    with_support_regions(block(), {both_ends[0], plane("again", {0.2, 0, 0}, {-1, 0, 0})}, "block");
  });
  EXPECT_NE(twice.find("'near' and 'again' overlap"), std::string::npos) << twice;
}

/// Tetrahedra of the block between two supports.
TetMesh filled() {
  const Surface body = with_support_regions(block(), both_ends, "block");
  TetMesh mesh = tetrahedralise(body, TetrahedraliseOptions{});
  mesh.muscle = reconstruction::reversed_region(body, Region::inner);
  assign_supports(mesh, both_ends);
  return mesh;
}

double volume_of_part(const TetMesh& mesh, int part) {
  double volume = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    volume += mesh.part_fraction(c, part) * cell_volume_mm3(mesh.points, mesh.cells, c);
  return volume;
}

TEST(Parts, SharesBesideAPlaneAreExact) {
  TetMesh mesh = filled();
  const Eigen::Vector3d oblique = Eigen::Vector3d(1, 0.3, 0.2).normalized();
  assign_parts(mesh, {plane("a", {23.7, 10, 10}, oblique), plane("b", {23.7, 10, 10}, -oblique)});
  // The plane cuts all four long edges: the volume behind it is that of the prism to its middle.
  EXPECT_NEAR(volume_of_part(mesh, 1), 23.7 * 400, 1e-8);
  EXPECT_NEAR(volume_of_part(mesh, 0), (60 - 23.7) * 400, 1e-8);
}

TEST(Parts, OfASurfaceAreCounted) {
  TetMesh mesh = filled();
  BodyPlace inside;
  inside.name = "inside";
  inside.surface = testing::boundary_surface(
      testing::moved(testing::box_mesh(1, 1, 1, {15, 40, 40}), Eigen::Matrix3d::Identity(), {20, -10, -10}));
  assign_parts(mesh, {inside});
  EXPECT_NEAR(volume_of_part(mesh, 0), 15 * 400, 0.03 * 15 * 400);
}

TEST(Parts, ThatOverlapOrHoldNothingAreRefused) {
  TetMesh mesh = filled();
  const std::string both = complaint([&] {
    assign_parts(mesh, {plane("a", {20, 0, 0}, {1, 0, 0}), plane("b", {40, 0, 0}, {-1, 0, 0})});
  });
  EXPECT_NE(both.find("'a' and 'b' overlap: 33"), std::string::npos) << both;
  TetMesh again = filled();
  const std::string none = complaint([&] { assign_parts(again, {plane("void", {100, 0, 0}, {1, 0, 0})}); });
  EXPECT_NE(none.find("'void' holds nothing"), std::string::npos) << none;
}

/// Tetrahedra of the block from a label map of 2 mm: 1 inside, outside what @p outside says; 0 is air, 2 the support
/// "a", 3 the support "b".
TetMesh from_voxels(const std::function<int(int i, int j, int k)>& outside) {
  using segmentation::Tissue;
  segmentation::GreyImage values;
  values.grid.size = {36, 16, 16};
  values.grid.spacing_mm.setConstant(2);
  values.grid.origin_mm.setConstant(-5);
  for (int k = -3; k < 13; ++k)
    for (int j = -3; j < 13; ++j)
      for (int i = -3; i < 33; ++i) {
        const bool inside = std::min({i, j, k}) >= 0 && i < 30 && std::max(j, k) < 10;
        values.voxels.push_back(static_cast<float>(inside ? 1 : outside(i, j, k)));
      }
  const std::map<int, Tissue> table = {
      {0, Tissue::air}, {1, Tissue::adipose}, {2, Tissue::muscle}, {3, Tissue::muscle}};
  const Surface body = reconstruction::reconstruct(map_labels(values, table, "block").image, {}).breast.surface;
  const DecimateOptions coarser{.target_triangles = 800, .method = DecimateMethod::triangles};
  TetMesh mesh = tetrahedralise(decimate(body, coarser).surface, TetrahedraliseOptions{});
  mesh.muscle = reconstruction::reversed_region(body, Region::inner);
  assign_supports(mesh, segmentation::mark_supports(values, {{"a", {2}}, {"b", {3}}}), values.grid);
  return mesh;
}

/// Every face on a support whose centre is farther than @p band_mm from x = 30 lies on "a" before it, on "b" behind.
void expect_parted(const TetMesh& mesh, double band_mm, double area_mm2) {
  ASSERT_EQ(mesh.support_names, (std::vector<std::string>{"a", "b"}));
  const Eigen::VectorXi support = support_of_faces(mesh);
  for (Eigen::Index f = 0; f < support.size(); ++f) {
    const double x = face_point(mesh.points, mesh.faces, f, 1.0 / 3, 1.0 / 3).x();
    if (support[f] >= 0 && std::abs(x - 30) > band_mm) {
      EXPECT_EQ(support[f], x < 30 ? 0 : 1) << x;
    }
  }
  for (const int s : {0, 1}) EXPECT_NEAR(support_area(mesh, support, s).area_mm2, area_mm2, 0.1 * area_mm2) << s;
}

TEST(Supports, OfALabelMapGoToTheFacesNearThem) {
  expect_parted(from_voxels([](int i, int, int) { return i < 0 ? 2 : i >= 30 ? 3 : 0; }), 0, 400);
}

TEST(Supports, OfALabelMapThatMeetPartAtTheirBorder) {
  constexpr double edge_mm = 4;
  expect_parted(from_voxels([](int i, int, int k) { return k >= 0 ? 0 : i < 15 ? 2 : 3; }), edge_mm, 600);
}

TEST(Supports, ComeBackFromTheFileWithPartsAndFaces) {
  TetMesh mesh = filled();
  assign_parts(mesh, {plane("tip", {30, 0, 0}, {1, 0, 0})});
  const pipeline::TemporaryFolder folder;
  write_mesh(mesh, folder / "mesh.vtu", "none");
  const TetMesh read = read_mesh(folder / "mesh.vtu");
  EXPECT_EQ(read.support_names, mesh.support_names);
  EXPECT_EQ(read.part_names, mesh.part_names);
  EXPECT_EQ(read.part_fraction, mesh.part_fraction);
  EXPECT_EQ(read.muscle_support, mesh.muscle_support);
  const Eigen::VectorXi support = support_of_faces(read);
  for (Eigen::Index f = 0; f < support.size(); ++f) {
    const double x = face_point(read.points, read.faces, f, 1.0 / 3, 1.0 / 3).x();
    EXPECT_EQ(support[f], x < 1e-9 ? 0 : x > 60 - 1e-9 ? 1 : -1);
  }
  const SupportArea area = support_area(read, support, 1);
  EXPECT_NEAR(area.area_mm2, 400, 1e-9);
  EXPECT_NEAR(area.bending_mm4, std::pow(20.0, 4) / 12, 1e-6);
  EXPECT_NEAR(area.polar_mm4, std::pow(20.0, 4) / 6, 1e-6);
}

TEST(SharpEdges, StayWhereTheyAre) {
  Surface body = with_support_regions(block(), both_ends, "block");
  const DecimateResult result = decimate(body, {.edge_mm = 6, .sharp_deg = 40});
  const auto report = reconstruction::check_surface(result.surface);
  EXPECT_NEAR(report.volume_mm3, 24000, 1e-6);
  EXPECT_NEAR(report.region_area_mm2[static_cast<int>(Region::inner)], 800, 1e-6);
  EXPECT_LT(result.distance_mm, 1e-6);
  EXPECT_GT(result.surface.triangles.rows(), 2 * body.triangles.rows());
}

}  // namespace
}  // namespace supine::meshing
