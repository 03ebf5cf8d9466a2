// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/fronts/fast_marching.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <random>

#include "tests/segmentation/formats/image_files.h"
#include "tests/segmentation/fronts/plain_march.h"

namespace supine::segmentation {
namespace {

using testing::message_of;

/// A box of constant speed, oblique, 40 x 36 x 28 mm.
Image<float> box(double h, const Eigen::Vector3d& stretch, float speed = 1) {
  Image<float> image;
  image.grid.spacing_mm = h * stretch;
  for (int a = 0; a < 3; ++a)
    image.grid.size[a] = static_cast<int>(std::lround(Eigen::Vector3d(40, 36, 28)[a] / image.grid.spacing_mm[a])) + 1;
  image.grid.direction = testing::oblique();
  image.grid.origin_mm = {-13, 7, 21};
  image.voxels.assign(image.grid.count(), speed);
  return image;
}

Eigen::Vector3d inside(const Grid& grid, const Eigen::Vector3d& from_corner_mm) {
  return grid.origin_mm + grid.direction * from_corner_mm;
}

/// Root mean square error against the distance to the nearest source.
double error(const Image<float>& time, const std::vector<FrontSource>& sources) {
  double squares = 0;
  for (int k = 0; k < time.grid.size.z(); ++k)
    for (int j = 0; j < time.grid.size.y(); ++j)
      for (int i = 0; i < time.grid.size.x(); ++i) {
        double exact = INFINITY;
        for (const FrontSource& s : sources)
          exact = std::min(exact, s.time + (time.grid.point(Eigen::Vector3d(i, j, k)) - s.point_mm).norm());
        squares += std::pow(time.at(i, j, k) - exact, 2);
      }
  return std::sqrt(squares / static_cast<double>(time.voxels.size()));
}

/// Rate of convergence from h to h / 2 on one source, exact within 6 mm of it.
double rate(int order, const Eigen::Vector3d& stretch) {
  double errors[2];
  for (int level = 0; level < 2; ++level) {
    const Image<float> speed = box(level == 0 ? 1.0 : 0.5, stretch);
    const std::vector<FrontSource> sources = {{inside(speed.grid, {18, 16, 12}), 0}};
    errors[level] = error(fast_march(speed, sources, {order, INFINITY, 6}), sources);
  }
  return std::log2(errors[0] / errors[1]);
}

TEST(FastMarching, FirstOrderConvergesAtRateOne) {
  EXPECT_NEAR(rate(1, {1, 1, 1}), 1, 0.15);
  EXPECT_NEAR(rate(1, {0.5, 1, 2}), 1, 0.2);
}

TEST(FastMarching, SecondOrderConvergesAtRateTwo) {
  EXPECT_NEAR(rate(2, {1, 1, 1}), 2, 0.3);
  EXPECT_NEAR(rate(2, {0.5, 1, 2}), 2, 0.35);
}

TEST(FastMarching, TakesTheEarliestOfSeveralSources) {
  const Image<float> speed = box(0.5, {1, 1, 1});
  const std::vector<FrontSource> sources = {{inside(speed.grid, {5, 6, 7}), 0}, {inside(speed.grid, {31, 20, 18}), 4}};
  EXPECT_LT(error(fast_march(speed, sources, {2, INFINITY, 3}), sources), 0.05);  // a tenth of a voxel
}

TEST(FastMarching, TimeScalesWithTheSpeedAndStopsAtTheStoppingTime) {
  const Image<float> slow = box(1, {1, 1, 1}, 0.5f), fast = box(1, {1, 1, 1}, 2);
  const std::vector<FrontSource> source = {{inside(slow.grid, {18, 16, 12}), 0}};
  const auto a = fast_march(slow, source, {}), b = fast_march(fast, source, {});
  for (std::size_t n = 0; n < a.voxels.size(); ++n) ASSERT_NEAR(a.voxels[n], 4 * b.voxels[n], 1e-3);
  const auto stopped = fast_march(slow, source, {2, 20, 0});
  for (std::size_t n = 0; n < a.voxels.size(); ++n) {
    if (a.voxels[n] < 19.99f) {
      ASSERT_FLOAT_EQ(stopped.voxels[n], a.voxels[n]);
    } else if (a.voxels[n] > 20.01f) {
      ASSERT_TRUE(std::isinf(stopped.voxels[n]));
    }
  }
}

TEST(FastMarching, GoesAroundWallsAndNotThroughThem) {
  Image<float> speed;
  speed.grid.size = {41, 41, 1};
  speed.grid.spacing_mm = {1, 1, 1};
  speed.voxels.assign(41 * 41, 1.0f);
  for (int j = 0; j <= 30; ++j) speed.at(20, j, 0) = 0;  // a wall with its end at (20, 31)
  const std::vector<FrontSource> source = {{{10, 10, 0}, 0}};
  const auto time = fast_march(speed, source, {2, INFINITY, 3});
  EXPECT_TRUE(std::isinf(time.at(20, 10, 0)));
  const double around = std::hypot(10, 21) + std::hypot(10, 21);  // by way of (20, 31)
  EXPECT_NEAR(time.at(30, 10, 0), around, 0.03 * around);         // half a voxel at each corner
}

TEST(FastMarching, TwoLayersObeySnell) {
  // Fast below y = 0: the earliest way to a far point of the surface runs straight along it (a head wave).
  Image<float> speed;
  speed.grid.size = {201, 41, 1};
  speed.grid.spacing_mm = {0.5, 0.5, 0.5};
  speed.grid.origin_mm = {0, -10, 0};
  speed.voxels.resize(speed.grid.count());
  for (int j = 0; j < 41; ++j)
    for (int i = 0; i < 201; ++i) speed.at(i, j, 0) = j < 20 ? 4 : 1;
  const std::vector<FrontSource> source = {{{10, 5, 0}, 0}};
  const auto time = fast_march(speed, source, {2, INFINITY, 2});
  // Down at the critical angle (sin = 1/4), along, up again; the interface lies between rows 19 and 20, y = -0.25.
  const double depth = 5.25,
               exact = (80 - 2 * depth * std::tan(std::asin(0.25))) / 4 + 2 * depth / std::cos(std::asin(0.25));
  EXPECT_NEAR(time.at(180, 30, 0), exact, 0.02 * exact);
}

TEST(FastMarching, FillsADeadEndLateAndManyBucketsApart) {
  // Speeds six decades apart: times beyond the queue's buckets.
  Image<float> speed;
  speed.grid.size = {30, 1, 1};
  speed.voxels.assign(30, 1.0f);
  for (int i = 10; i < 20; ++i) speed.voxels[static_cast<std::size_t>(i)] = 1e-6f;
  const std::vector<FrontSource> source = {{{0, 0, 0}, 0}};
  const auto time = fast_march(speed, source, {1, INFINITY, 0});
  EXPECT_NEAR(time.voxels[9], 9, 1e-4);
  EXPECT_NEAR(time.voxels[29] / 1e7, 1, 1e-4);
}

/// A box whose voxel centres are exact in floating point: a source there gives no other voxel its time.
Image<float> straight_box() {
  Image<float> speed = box(1, {1, 0.75, 1.5});
  speed.grid.direction.setIdentity();
  return speed;
}

/// Speeds 0.5 to 2.5 and a wall with a gap.
Image<float> uneven_box() {
  Image<float> speed = straight_box();
  const Eigen::Vector3i& size = speed.grid.size;
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i) {
        const double wave = std::sin(0.13 * i) * std::cos(0.1 * j) * std::sin(0.3 * k);
        speed.at(i, j, k) = i == 28 && j > 5 ? 0 : static_cast<float>(1.5 + wave);
      }
  return speed;
}

/// Root mean square and largest difference over the voxels reached; the others must be the same.
std::pair<double, double> difference(const Image<float>& a, const Image<double>& b) {
  double squares = 0, largest = 0;
  std::size_t count = 0;
  for (std::size_t n = 0; n < a.voxels.size(); ++n) {
    EXPECT_EQ(std::isinf(a.voxels[n]), std::isinf(b.voxels[n])) << n;
    if (std::isinf(b.voxels[n])) continue;
    const double off = std::abs(a.voxels[n] - b.voxels[n]);
    squares += off * off;
    largest = std::max(largest, off);
    ++count;
  }
  return {std::sqrt(squares / static_cast<double>(count)), largest};
}

TEST(FastMarching, GivesTheTimesOfAPlainHeapInDoubles) {
  // To rounding: the order of the queue is exact, and waiting with the first solution changes nothing.
  const Image<float> even = straight_box(), uneven = uneven_box();
  const std::vector<FrontSource> sources = {{even.grid.point({15, 20, 9}), 0}, {even.grid.point({36, 1, 1}), 7}};
  for (const Image<float>* speed : {&even, &uneven})
    for (const int order : {1, 2}) {
      const auto [mean, worst] =
          difference(fast_march(*speed, sources, {order, INFINITY, 0}), testing::plain_march(*speed, sources, order));
      EXPECT_LT(mean, 1e-5) << "order " << order;
      EXPECT_LT(worst, 1e-4) << "order " << order;
    }
}

TEST(FastMarching, RandomSpeedsGiveTheTimesOfAPlainHeap) {
  Image<float> speed = straight_box();
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (float& v : speed.voxels) v = uniform(random) < 0.2f ? 0 : 0.1f + uniform(random);
  speed.at(15, 20, 9) = 1;
  const std::vector<FrontSource> source = {{speed.grid.point({15, 20, 9}), 0}};
  const auto [mean, worst] =
      difference(fast_march(speed, source, {1, INFINITY, 0}), testing::plain_march(speed, source, 1));
  EXPECT_LT(mean, 1e-5);
  EXPECT_LT(worst, 1e-4);
}

TEST(FastMarching, AFrontThroughASlowLayerComesInItsTurn) {
  // From row 0 to row 2: 300 through the slow row between, or 700 and back around its end.
  Image<float> speed;
  speed.grid.size = {701, 3, 1};
  speed.voxels.assign(speed.grid.count(), 1);
  for (int i = 0; i < 700; ++i) speed.at(i, 1, 0) = 1.0f / 300;
  const std::vector<FrontSource> source = {{{0, 0, 0}, 0}};
  const auto time = fast_march(speed, source, {1, INFINITY, 0});
  for (int i = 0; i < 300; ++i) ASSERT_NEAR(time.at(i, 2, 0), 301 + i, 1.5) << i;
}

TEST(FastMarching, IsTheSameBytesForAnyNumberOfThreads) {
  const Image<float> speed = uneven_box();
  const std::vector<FrontSource> source = {{speed.grid.point({15, 20, 9}), 0}};
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const auto one = fast_march(speed, source, {2, INFINITY, 3});
  omp_set_num_threads(3);
  const auto three = fast_march(speed, source, {2, INFINITY, 3});
  omp_set_num_threads(before);
  EXPECT_EQ(one.voxels, three.voxels);
}

TEST(FastMarching, SpeedsFallAtEdgesAndAwayFromTheTissue) {
  GreyImage image;
  image.grid.size = {11, 1, 1};
  image.grid.spacing_mm = {2, 1, 1};
  image.voxels = {0, 0, 0, 0, 0, 50, 100, 100, 100, 100, 100};
  const auto edge = speed_from_gradient(image, 0, 25);
  EXPECT_FLOAT_EQ(edge.voxels[5], 0.5f);  // 100 over 4 mm
  EXPECT_FLOAT_EQ(edge.voxels[0], 1.0f);
  const auto tissue = speed_from_greys(image, 100, 50);
  EXPECT_FLOAT_EQ(tissue.voxels[10], 1.0f);
  EXPECT_FLOAT_EQ(tissue.voxels[5], std::exp(-0.5f));
  EXPECT_FLOAT_EQ(speed_from_greys(image, 100, 10).voxels[0], 0.0f);
}

TEST(FastMarching, RefusesWhatCannotMarch) {
  Image<float> speed = box(4, {1, 1, 1});
  const std::vector<FrontSource> source = {{inside(speed.grid, {18, 16, 12}), 0}}, none;
  const std::vector<FrontSource> outside = {{inside(speed.grid, {60, 16, 12}), 0}}, early = {{source[0].point_mm, -1}};
  const auto message = [&](const std::vector<FrontSource>& s, FastMarchingOptions o) {
    return message_of([&] { fast_march(speed, s, o); });
  };
  EXPECT_NE(message(source, {3, INFINITY, 0}).find("order 3"), std::string::npos);
  EXPECT_NE(message(source, {1, 0, 0}).find("stop_time 0"), std::string::npos);
  EXPECT_NE(message(source, {1, INFINITY, -1}).find("source_radius_mm -1"), std::string::npos);
  EXPECT_NE(message(none, {}).find("no source"), std::string::npos);
  EXPECT_NE(message(outside, {}).find("outside the image"), std::string::npos);
  EXPECT_NE(message(early, {}).find("time -1"), std::string::npos);
  Image<float> large;
  large.grid.size = {2000, 2000, 2000};
  EXPECT_NE(message_of([&] { fast_march(large, source, {}); }).find("at most 4294967295"), std::string::npos);
  speed.voxels[3] = -2;
  EXPECT_NE(message(source, {}).find("voxel 3 is -2"), std::string::npos);
  speed.voxels.assign(speed.voxels.size(), 0.0f);
  EXPECT_NE(message(source, {}).find("is 0"), std::string::npos);
  EXPECT_NE(message_of([&] { speed_from_greys(speed, 1, 0); }).find("sd 0"), std::string::npos);
  EXPECT_NE(message_of([&] { speed_from_gradient(speed, 1, 0); }).find("half_per_mm 0"), std::string::npos);
  EXPECT_NE(message_of([&] { speed_from_gradient(speed, -1, 1); }).find("sigma_mm -1"), std::string::npos);
}

}  // namespace
}  // namespace supine::segmentation
