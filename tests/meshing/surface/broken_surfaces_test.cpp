// SPDX-License-Identifier: AGPL-3.0-or-later
// A corpus of broken surfaces: each is refused with its kind and its place in mm, or decimated to a sound surface.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/error.h"
#include "meshing/decimate/decimate.h"
#include "meshing/surface/sound_surface.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "reconstruction/surface_check.h"
#include "tests/meshing/surface_shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::check_surface;
using reconstruction::Surface;
using testing::grid;
using testing::inside_out;
using testing::moved_by;
using testing::together;
using testing::torus;
using testing::voxels;

constexpr int places = 5;       // at which each fault is made
constexpr double near_mm = 10;  // a little more than two edges of the torus; how far a named place may be off

struct Fault {
  std::string name;
  std::string word;  // of the refusal; empty where the surface is to be decimated soundly
  /// Spoils the torus at a triangle. @return where, or nothing when the fault is all over it
  std::function<std::optional<Eigen::Vector3d>(Surface&, int)> spoil;
};

void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

Eigen::Vector3d centre(const Surface& s, int t) {
  return (s.points.row(s.triangles(t, 0)) + s.points.row(s.triangles(t, 1)) + s.points.row(s.triangles(t, 2)))
             .transpose() /
         3;
}

int add_point(Surface& s, const Eigen::RowVector3d& at) {
  s.points.conservativeResize(s.points.rows() + 1, 3);
  s.points.row(s.points.rows() - 1) = at;
  return static_cast<int>(s.points.rows()) - 1;
}

void add_triangle(Surface& s, int a, int b, int c) {
  s.triangles.conservativeResize(s.triangles.rows() + 1, 3);
  s.triangles.row(s.triangles.rows() - 1) << a, b, c;
}

// Cuts triangle t in three at a point with these weights.
void split(Surface& s, int t, const Eigen::RowVector3d& weights) {
  const Eigen::RowVector3i old = s.triangles.row(t);
  const int p = add_point(
      s, weights[0] * s.points.row(old[0]) + weights[1] * s.points.row(old[1]) + weights[2] * s.points.row(old[2]));
  s.triangles.row(t) << old[0], old[1], p;
  add_triangle(s, old[1], old[2], p);
  add_triangle(s, old[2], old[0], p);
}

Surface small_ball(const Eigen::Vector3d& at, double radius) {
  Surface s = voxels(8, 8, 8, radius / 4,
                     [](int x, int y, int z) { return Eigen::Vector3d(x - 3.5, y - 3.5, z - 3.5).norm() < 4; });
  s.points.rowwise() += (at.array() - radius).matrix().transpose();
  return s;
}

void remove_triangles(Surface& s, int first, int count) {
  std::vector<int> kept;
  for (int t = 0; t < s.triangles.rows(); ++t)
    if (t < first || t >= first + count) kept.push_back(t);
  s.triangles = Triangles(s.triangles(kept, Eigen::all));
}

std::vector<Fault> faults() {
  using Where = std::optional<Eigen::Vector3d>;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {
      {"one_triangle_flipped", "not a manifold",
       [](Surface& s, int t) -> Where {
         std::swap(s.triangles(t, 0), s.triangles(t, 1));
         return centre(s, t);
       }},
      {"patch_flipped", "not a manifold",
       [](Surface& s, int t) -> Where {
         for (int i = t; i < t + 7; ++i) std::swap(s.triangles(i, 0), s.triangles(i, 1));
         return centre(s, t + 3);
       }},
      {"all_flipped", "face inward",
       [](Surface& s, int) -> Where {
         s = inside_out(s);
         return {};
       }},
      {"one_of_two_bodies_flipped", "face inward",
       [](Surface& s, int t) -> Where {
         const Eigen::Vector3d at(10.0 * t / 1000, 0, 60);
         s = together(s, inside_out(small_ball(at, 6)));
         return at;
       }},
      {"body_inside_a_body", "inside another",
       [](Surface& s, int t) -> Where {
         const double a = t;
         const Eigen::Vector3d at(30 * std::cos(a), 30 * std::sin(a), 0);
         s = together(s, small_ball(at, 4));
         return at;
       }},
      {"triangle_twice", "not a manifold",
       [](Surface& s, int t) -> Where {
         add_triangle(s, s.triangles(t, 0), s.triangles(t, 1), s.triangles(t, 2));
         return centre(s, t);
       }},
      {"triangle_twice_turned", "not a manifold",
       [](Surface& s, int t) -> Where {
         add_triangle(s, s.triangles(t, 1), s.triangles(t, 0), s.triangles(t, 2));
         return centre(s, t);
       }},
      {"all_triangles_twice", "not a manifold",
       [](Surface& s, int) -> Where {
         const Triangles once = s.triangles;
         s.triangles.resize(2 * once.rows(), 3);
         s.triangles << once, once;
         return {};
       }},
      {"surface_twice_in_place", "intersects itself",
       [](Surface& s, int) -> Where {
         s = together(s, s);
         return {};
       }},
      {"points_not_shared", "not closed",
       [](Surface& s, int) -> Where {
         Surface soup;
         soup.points.resize(3 * s.triangles.rows(), 3);
         soup.triangles.resize(s.triangles.rows(), 3);
         for (Eigen::Index i = 0; i < s.triangles.size(); ++i) {
           soup.points.row(i) = s.points.row(s.triangles.data()[i]);
           soup.triangles.data()[i] = static_cast<int>(i);
         }
         s = soup;
         return {};
       }},
      {"fin", "not a manifold",
       [](Surface& s, int t) -> Where {
         const int p = add_point(s, 1.3 * s.points.row(s.triangles(t, 0)));
         add_triangle(s, s.triangles(t, 0), s.triangles(t, 1), p);
         return centre(s, t);
       }},
      {"two_sheets_at_a_point", "not a manifold",
       [](Surface& s, int t) -> Where {
         const int p = s.triangles(t, 0);
         const Eigen::RowVector3d at = s.points.row(p);
         const Surface ball = small_ball(Eigen::Vector3d(1.4 * at.x(), 1.4 * at.y(), 3 * at.z()), 2);
         const auto first = static_cast<int>(s.points.rows());
         s = together(s, ball);
         for (Eigen::Index i = 0; i < s.triangles.size(); ++i)
           if (s.triangles.data()[i] == first) s.triangles.data()[i] = p;
         return at.transpose();
       }},
      {"triangle_missing", "not closed",
       [](Surface& s, int t) -> Where {
         const Eigen::Vector3d at = centre(s, t);
         remove_triangles(s, t, 1);
         return at;
       }},
      {"hole", "not closed",
       [](Surface& s, int t) -> Where {
         const int first = t - t % 80 + 20;  // within one of the grid's rows
         const Eigen::Vector3d at = centre(s, first + 5);
         remove_triangles(s, first, 10);
         return at;
       }},
      {"half_missing", "not closed",
       [](Surface& s, int) -> Where {
         remove_triangles(s, 0, static_cast<int>(s.triangles.rows()) / 2);
         return {};
       }},
      {"point_pulled_through", "intersects itself",
       [](Surface& s, int t) -> Where {
         s.points.row(s.triangles(t, 0)) *= -1;
         return {};
       }},
      {"two_bodies_overlap", "intersects itself",
       [](Surface& s, int t) -> Where {
         const Eigen::Vector3d at = centre(s, t);
         s = together(s, small_ball(at, 3));
         return at;
       }},
      {"two_bodies_touch", "intersects itself",
       [](Surface& s, int t) -> Where {
         // A cube whose corner is a point of the torus.
         Surface cube = voxels(2, 2, 2, 1, [](int, int, int) { return true; });
         const Eigen::Vector3d at = s.points.row(s.triangles(t, 0));
         s = together(s, moved_by(cube, at.transpose()));
         return at;
       }},
      {"triangle_folded_over", "intersects itself",
       [](Surface& s, int t) -> Where {
         // One corner goes across the opposite edge, in the surface.
         const Eigen::RowVector3d a = s.points.row(s.triangles(t, 0)),
                                  m = 0.5 * (s.points.row(s.triangles(t, 1)) + s.points.row(s.triangles(t, 2)));
         s.points.row(s.triangles(t, 0)) = m + 1.2 * (m - a);
         return m.transpose();
       }},
      {"point_without_place", "no place",
       [](Surface& s, int t) -> Where {
         s.points(s.triangles(t, 1), 2) = nan;
         return {};
       }},
      {"point_infinitely_far", "no place",
       [](Surface& s, int t) -> Where {
         s.points(s.triangles(t, 1), 0) = std::numeric_limits<double>::infinity();
         return {};
       }},
      {"corner_twice_in_a_triangle", "without area",
       [](Surface& s, int t) -> Where {
         s.triangles(t, 1) = s.triangles(t, 0);
         return centre(s, t);
       }},
      {"two_points_at_one_place", "without area",
       [](Surface& s, int t) -> Where {
         s.points.row(s.triangles(t, 1)) = s.points.row(s.triangles(t, 0));
         return centre(s, t);
       }},
      {"point_on_an_edge", "without area",
       [](Surface& s, int t) -> Where {
         const Eigen::Vector3d at = centre(s, t);
         split(s, t, {0.5, 0.5, 0});
         return at;
       }},
      {"needles", "",
       [](Surface& s, int t) -> Where {
         for (int i = t; i < t + 60; i += 3) split(s, i, {0.4999, 0.4999, 0.0002});
         return {};
       }},
      {"thorns_of_tiny_triangles", "",
       [](Surface& s, int t) -> Where {
         for (int i = t; i < t + 60; i += 3) split(s, i, {0.99999, 0.000005, 0.000005});
         return {};
       }},
      {"points_used_by_none", "",
       [](Surface& s, int) -> Where {
         add_point(s, {900, std::numeric_limits<double>::quiet_NaN(), 0});
         return {};
       }},
  };
}

std::optional<Eigen::Vector3d> place_in(const std::string& message) {
  Eigen::Vector3d at;
  const std::size_t end = message.find(") mm");
  if (end == std::string::npos) return {};
  const std::size_t begin = message.rfind('(', end);
  if (std::sscanf(message.c_str() + begin, "(%lf, %lf, %lf)", &at[0], &at[1], &at[2]) != 3) return {};
  return at;
}

class BrokenSurfaces : public ::testing::TestWithParam<Fault> {};

TEST_P(BrokenSurfaces, AreRefusedWithTheirPlaceOrDecimatedSoundly) {
  const Fault& fault = GetParam();
  for (int i = 0; i < (fault.word.empty() ? 1 : places); ++i) {
    Surface s = torus(30, 12);
    const std::optional<Eigen::Vector3d> where = fault.spoil(s, 217 + 1373 * i);
    std::string message;
    try {
      const DecimateResult result = decimate(s, {.target_triangles = 600, .max_distance_mm = 2});
      EXPECT_TRUE(fault.word.empty()) << "decimated in silence";
      EXPECT_TRUE(check_surface(result.surface).closed());
      EXPECT_EQ(check_surface(result.surface).genus(), 1);
      EXPECT_LE(result.distance_mm, 2);
      EXPECT_TRUE(reconstruction::self_intersections(result.surface).empty());
      continue;
    } catch (const InputError& error) {
      message = error.what();
    }
    ASSERT_FALSE(fault.word.empty()) << message;
    EXPECT_NE(message.find(fault.word), std::string::npos) << message;
    const auto named = place_in(message);
    ASSERT_TRUE(named) << message;
    if (where) {
      EXPECT_LT((*named - *where).norm(), near_mm) << message << " at " << where->transpose();
    }
  }
}

// The mesher looks for itself: its surface need not come from decimation.
TEST_P(BrokenSurfaces, AreRefusedByTheMesherToo) {
  const Fault& fault = GetParam();
  if (fault.word.empty()) return;
  Surface s = torus(30, 12);
  fault.spoil(s, 217);
  s.region = Eigen::VectorXi::Constant(s.triangles.rows(), 2);
  try {
    tetrahedralise(s, {}, "torus.vtp");
    ADD_FAILURE() << "filled in silence";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(fault.word), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("torus.vtp"), std::string::npos) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(Corpus, BrokenSurfaces, ::testing::ValuesIn(faults()),
                         [](const auto& test) { return test.param.name; });

TEST(SoundSurface, OpenSheetsMustAgreeOnTheirSides) {
  // A band with half a turn has one side only.
  const Surface strip = grid(60, 6, false, false, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u, w = 8 * (v - 0.5);
    const double r = 30 + w * std::cos(a / 2);
    return Eigen::Vector3d(r * std::cos(a), r * std::sin(a), w * std::sin(a / 2));
  });
  EXPECT_NO_THROW(require_sound(torus(30, 12), Borders::closed, "torus"));
  Surface band = strip;
  for (Eigen::Index i = 0; i < band.triangles.size(); ++i) {
    int& p = band.triangles.data()[i];
    if (p >= 60 * 7) p = 6 - (p - 60 * 7);
  }
  try {
    decimate(band, {.target_triangles = 200, .open = true});
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("orientation"), std::string::npos) << error.what();
  }
}

TEST(SoundSurface, NamesTrianglesOfPointsThereAreNot) {
  Surface s = torus(30, 12);
  s.triangles(40, 2) = static_cast<int>(s.points.rows());
  EXPECT_THROW(require_sound(s, Borders::closed, "torus"), InputError);
  s.triangles(40, 2) = -1;
  EXPECT_THROW(require_sound(s, Borders::closed, "torus"), InputError);
  s.triangles.resize(0, 3);
  EXPECT_THROW(require_sound(s, Borders::closed, "torus"), InputError);
}

TEST(SoundSurface, WindingNumberCountsRounds) {
  const Surface s = torus(30, 12);
  EXPECT_NEAR(winding_number(s.points, s.triangles, {30, 0, 0}), 1, 1e-9);
  EXPECT_NEAR(winding_number(s.points, s.triangles, {0, 0, 0}), 0, 1e-9);
  EXPECT_NEAR(winding_number(s.points, inside_out(s).triangles, {0, 30, 5}), -1, 1e-9);
}

}  // namespace
}  // namespace supine::meshing
