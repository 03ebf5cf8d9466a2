// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "reconstruction/surface_check.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;
using testing::message_of;
using testing::voxelise;

// Rim of tissue 10 mm thick on a muscle slab (y > 0) out to 40 mm, with excluded tissue beyond, air in front of it.
Tissue disc_in_excluded(const Eigen::Vector3d& at) {
  if (at.y() > 0) return Tissue::muscle;
  if (at.y() < -10) return Tissue::air;
  return std::hypot(at.x(), at.z()) < 40 ? Tissue::adipose : Tissue::excluded;
}

LabelImage disc_image() { return voxelise(testing::cubic_grid(Eigen::Vector3d(48, 18, 48), 1.5), disc_in_excluded); }

// Areas by region after the voxel surface has been given its regions; of the staircase, so some 10 % large when
// oblique.
SurfaceReport areas(const LabelImage& image, const CutRules& rules) {
  const VoxelSurface breast = voxel_surface(image, meshed_tissues());
  Surface surface = breast.surface;
  surface.region = regions_of(breast, image, rules);
  return check_surface(surface);
}

double area(const SurfaceReport& report, Region region) { return report.region_area_mm2[static_cast<int>(region)]; }

TEST(Regions, WhatLiesBeyondDecides) {
  CutRules rules;
  rules.excluded = true;
  const SurfaceReport report = areas(disc_image(), rules);
  const double disc = std::numbers::pi * 40 * 40, band = 2 * std::numbers::pi * 40 * 10;
  EXPECT_NEAR(area(report, Region::inner) / disc, 1, 0.04);
  EXPECT_NEAR(area(report, Region::skin) / disc, 1, 0.04);
  EXPECT_NEAR(area(report, Region::cut) / band, 1.05, 0.15);
  EXPECT_EQ(area(report, Region::none), 0);
}

TEST(Regions, EveryRegionIsOnePatch) {
  CutRules rules;
  rules.excluded = true;
  const LabelImage image = disc_image();
  const VoxelSurface breast = voxel_surface(image, meshed_tissues());
  const Eigen::VectorXi region = regions_of(breast, image, rules);
  for (const Region r : {Region::inner, Region::skin, Region::cut}) {
    Triangles patch(0, 3);
    for (Eigen::Index t = 0; t < region.size(); ++t) {
      if (region(t) != static_cast<int>(r)) continue;
      patch.conservativeResize(patch.rows() + 1, 3);
      patch.row(patch.rows() - 1) = breast.surface.triangles.row(t);
    }
    const std::vector<int> component = triangle_components(patch);
    EXPECT_EQ(*std::max_element(component.begin(), component.end()), 0) << region_names[static_cast<int>(r)];
  }
}

TEST(Regions, SpeckOfAnotherLabelIsNoIsland) {
  LabelImage image = disc_image();
  const Eigen::Vector3i speck = image.grid.continuous_index({10, -11, 5}).array().round().cast<int>();
  image.at(speck.x(), speck.y(), speck.z()) = static_cast<std::uint8_t>(Tissue::excluded);
  image.at(speck.x() + 1, speck.y(), speck.z()) = static_cast<std::uint8_t>(Tissue::muscle);
  CutRules rules;
  rules.excluded = true;
  EXPECT_EQ(area(areas(image, rules), Region::inner), area(areas(disc_image(), rules), Region::inner));
}

TEST(Regions, CutThatIsNotAllowedIsRefusedWithPlaceAndRemedy) {
  const std::string excluded = message_of([] { areas(disc_image(), {}); });
  EXPECT_NE(excluded.find("excluded"), std::string::npos);
  EXPECT_NE(excluded.find("mm LPS"), std::string::npos);
  EXPECT_NE(excluded.find("case.toml"), std::string::npos);

  const LabelImage touching = voxelise(testing::cubic_grid(Eigen::Vector3d(20, 18, 20), 1.5), disc_in_excluded);
  const std::string edge = message_of([&] { areas(touching, {}); });
  EXPECT_NE(edge.find("edge of the image"), std::string::npos);
  EXPECT_NE(edge.find("\"edge\""), std::string::npos);
  CutRules rules;
  rules.edge = true;
  EXPECT_GT(area(areas(touching, rules), Region::cut), 4 * 40 * 10 * 0.9) << "four sides of the box, closed by padding";
}

TEST(Regions, BareTissueNearTheMuscleIsRim) {
  // The outer 3 mm of the dome are skin from 12 mm above the muscle on; below, the tissue is bare.
  const auto bare = [](const Eigen::Vector3d& at) {
    const Tissue tissue = testing::dome_on_slab(at);
    return tissue == Tissue::skin && at.y() > -12 ? Tissue::adipose : tissue;
  };
  const LabelImage image = voxelise(testing::cubic_grid(Eigen::Vector3d(44, 36, 44), 1.5), bare);
  CutRules rules;
  try {
    areas(image, rules);
    FAIL() << "a broad bare face must not become skin without a word";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("\"rim\""), std::string::npos) << error.what();
  }
  rules.rim = true;
  rules.rim_mm = 6;
  const double low = area(areas(image, rules), Region::cut);
  rules.rim_mm = 30;
  const double all = area(areas(image, rules), Region::cut);
  // A zone of a sphere of radius 30 has the area 2 π 30 times its height; the staircase adds up to 10 %.
  EXPECT_NEAR(low / (2 * std::numbers::pi * 30 * 6), 1.05, 0.25);
  EXPECT_NEAR(all / (2 * std::numbers::pi * 30 * 12), 1.05, 0.15);
}

}  // namespace
}  // namespace supine::reconstruction
