// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/superellipse.h"

#include <gtest/gtest.h>

#include <cmath>

namespace supine::segmentation {
namespace {

constexpr double centre_depth_mm = 90, middle_z_mm = 10;

/// Mean distance along rays, of which one is off by no more than a border's own reach.
double distance_mm(const Superellipse& a, const Superellipse& b) {
  double sum = 0;
  int rays = 0;
  for (double z = -60; z <= 80; z += 20)
    for (double angle = -1.8; angle <= 1.8; angle += 0.05, ++rays)
      sum += std::min(10.0, std::abs(a.radius_mm(angle, z) - b.radius_mm(angle, z)));
  return sum / rays;
}

Superellipse nearest(const Superellipse& wanted) {
  const auto cost = [&](const Superellipse& shape) { return distance_mm(shape, wanted); };
  Superellipse best;
  double least = INFINITY;
  for (const auto& of_width : superellipses_with_plates(cost, centre_depth_mm, middle_z_mm))
    for (const Superellipse& shape : of_width)
      if (cost(shape) < least) {
        least = cost(shape);
        best = shape;
      }
  return best;
}

TEST(Superellipse, PlateStandsOutToTheFrontBetweenItsEdges) {
  const Superellipse bare{150, 75, 0.1, 2.6, middle_z_mm};
  Superellipse plated = bare;
  plated.plate_mm = 12;
  const auto more = [&](double angle) { return plated.radius_mm(angle, 30) - bare.radius_mm(angle, 30); };
  EXPECT_DOUBLE_EQ(more(0), 0);  // the sternum is bare
  EXPECT_NEAR(more(0.5) * std::cos(0.5), 12, 1e-9);
  EXPECT_DOUBLE_EQ(more(0.5), more(-0.5));
  EXPECT_DOUBLE_EQ(more(1.3), 0);
  EXPECT_DOUBLE_EQ(more(3), 0);
  plated.plate_low_mm = 30;
  EXPECT_NEAR(more(0.5) * std::cos(0.5), 6, 1e-9);
  plated.plate_low_mm = 50;
  EXPECT_DOUBLE_EQ(more(0.5), 0);
}

TEST(Superellipse, ChestsWithAndWithoutMusclesAreFound) {
  for (const Superellipse& wanted :
       {Superellipse{155, 78, 0.1, 2.4, middle_z_mm, 13, 95}, Superellipse{125, 66, -0.2, 2.2, middle_z_mm, 8, 85},
        Superellipse{150, 72, 0.1, 2.4, middle_z_mm, 9, 90, middle_z_mm - 45},
        Superellipse{165, 82, 0, 2.8, middle_z_mm, 0, 95}}) {
    const Superellipse found = nearest(wanted);
    EXPECT_LT(distance_mm(found, wanted), 1.5) << wanted.half_width_mm;
    EXPECT_NEAR(found.plate_mm, wanted.plate_mm, 4) << wanted.half_width_mm;
  }
}

TEST(Superellipse, TheLikeliestOfAWidthComesFirstAndPlatesEndWhereMusclesDo) {
  const Superellipse wanted{155, 78, 0.1, 2.4, middle_z_mm, 13, 95};
  const auto cost = [&](const Superellipse& shape) { return distance_mm(shape, wanted); };
  const auto of_widths = superellipses_with_plates(cost, centre_depth_mm, middle_z_mm);
  EXPECT_EQ(of_widths.size(), 3);
  for (const auto& shapes : of_widths) {
    int high = 0, low = 0;
    for (std::size_t n = 0; n < shapes.size(); ++n) {
      if (n > 0) {
        EXPECT_LE(cost(shapes[n - 1]), cost(shapes[n]));
      }
      if (shapes[n].plate_mm == 0) continue;
      EXPECT_GE(shapes[n].plate_mm, 4);
      EXPECT_LE(shapes[n].plate_edge_mm, 120);
      const double under_mm = middle_z_mm - shapes[n].plate_low_mm;
      high += under_mm >= 15 && under_mm <= 45;
      low += under_mm >= 40 && under_mm <= 70;
    }
    EXPECT_GE(high, 1);
    EXPECT_GE(low, 1) << "by the sum alone all these muscles would end below the image";
  }
}

TEST(Superellipse, SidesThatAreNotSeenLeaveNarrowAndWideChestsToChooseFrom) {
  const Superellipse wanted{165, 80, 0, 2.6, middle_z_mm};
  const auto front_alone = [&](const Superellipse& shape) {
    double sum = 0;
    for (double angle = -0.5; angle <= 0.5; angle += 0.05)
      sum += std::abs(shape.radius_mm(angle, middle_z_mm) - wanted.radius_mm(angle, middle_z_mm));
    return sum;
  };
  double narrowest = INFINITY, widest = 0;
  for (const auto& of_width : superellipses_with_plates(front_alone, centre_depth_mm, middle_z_mm)) {
    narrowest = std::min(narrowest, of_width.front().half_width_mm);
    widest = std::max(widest, of_width.front().half_width_mm);
  }
  EXPECT_LT(narrowest, 130);
  EXPECT_GT(widest, 140);
}

}  // namespace
}  // namespace supine::segmentation
