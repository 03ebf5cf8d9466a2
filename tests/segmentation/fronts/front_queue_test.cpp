// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/fronts/front_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "segmentation/fronts/front_grid.h"

// What fast marching is made of: the queue of exact order, and the grid in bricks.
namespace supine::segmentation {
namespace {

/// Takes the earliest entry; false when there is none.
bool take(FrontQueue& queue, FrontQueue::Entry& entry) {
  while (queue.used_up()) {
    if (queue.next_bucket() == FrontQueue::none) return false;
    queue.open_next([](const auto&) { return true; }, [](const auto&) {});
  }
  entry = queue.earliest();
  queue.pop();
  return true;
}

TEST(FrontQueue, GivesEverythingInTheOrderOfTheTimesOverManyDecades) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> exponent(-30, 30);
  std::vector<float> times = {0, 0, 1e-40f, 3e38f};
  for (int n = 0; n < 20000; ++n) times.push_back(std::pow(10.0f, exponent(random)));
  for (int n = 0; n < 20000; ++n) times.push_back(1 + 1e-3f * exponent(random));  // full buckets, equal times
  FrontQueue queue;
  for (std::size_t n = 0; n < times.size(); ++n) queue.push(times[n], static_cast<std::uint32_t>(n));
  std::vector<float> sorted = times;
  std::sort(sorted.begin(), sorted.end());
  std::vector<int> seen(times.size(), 0);
  FrontQueue::Entry entry;
  for (const float expected : sorted) {
    ASSERT_TRUE(take(queue, entry));
    ASSERT_EQ(entry.time(), expected);
    ASSERT_EQ(times[entry.item()], expected);
    ASSERT_EQ(seen[entry.item()]++, 0);
  }
  EXPECT_FALSE(take(queue, entry));
}

TEST(FrontQueue, KeepsTheOrderWhenEntriesComeWhileOthersAreTaken) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> step(0, 1);
  FrontQueue queue;
  for (std::uint32_t n = 0; n < 500; ++n) queue.push(100 + step(random), n);
  FrontQueue::Entry entry;
  float now = 0;
  std::uint32_t taken = 0, pushed = 500;
  while (take(queue, entry)) {
    ASSERT_GE(entry.time(), now);
    now = entry.time();
    ++taken;
    for (int n = 0; n < 2 && pushed < 50000; ++n)  // some in the open bucket, some far away
      queue.push(now + std::pow(step(random), 8.0f) * 50, pushed++);
  }
  EXPECT_EQ(taken, 50000u);
}

TEST(FrontQueue, ForgetsWhatIsRefusedWhenItsBucketOpens) {
  FrontQueue queue;
  for (std::uint32_t n = 0; n < 1000; ++n) queue.push(5, n);
  queue.open_next([](FrontQueue::Entry entry) { return entry.item() % 10 == 0; }, [](const auto&) {});
  FrontQueue::Entry entry;
  int count = 0;
  for (; take(queue, entry); ++count) ASSERT_EQ(entry.item() % 10, 0u);
  EXPECT_EQ(count, 100);
}

TEST(FrontGrid, NeighboursLieBesideTheirVoxelAcrossBricks) {
  const Eigen::Vector3i size(37, 19, 21);
  const FrontGrid grid(size);
  std::vector<std::uint32_t> all;
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i) {
        all.push_back(grid.index(i, j, k));
        const FrontGrid::Neighbours expected = {grid.index(i - 1, j, k), grid.index(i + 1, j, k),
                                                grid.index(i, j - 1, k), grid.index(i, j + 1, k),
                                                grid.index(i, j, k - 1), grid.index(i, j, k + 1)};
        ASSERT_EQ(grid.neighbours(all.back()), expected) << i << " " << j << " " << k;
      }
  std::sort(all.begin(), all.end());
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
  EXPECT_LT(all.back(), FrontGrid::stored(size));
  EXPECT_TRUE(grid[grid.index(-1, 3, 4)].is_passed());
  EXPECT_TRUE(std::isinf(grid[grid.index(37, 3, 4)].time()));
}

TEST(FrontState, TellsTimesSlownessesAndRecordsApart) {
  for (const float time : {0.0f, 1e-30f, 12.5f, 3e38f}) {
    EXPECT_TRUE(FrontState::passed(time).is_passed());
    EXPECT_EQ(FrontState::passed(time).time(), time);
    EXPECT_TRUE(FrontState::passed(time).passed_by(time));
    EXPECT_FALSE(FrontState::passed(std::nextafter(time, INFINITY)).passed_by(time));
  }
  for (const float slowness : {1.0f, 1.5f, 1e20f, 3e38f}) {
    EXPECT_TRUE(FrontState::fresh(slowness).is_fresh());
    EXPECT_FALSE(FrontState::fresh(slowness).passed_by(3e38f));
    EXPECT_EQ(FrontState::fresh(slowness).slowness(), slowness);
  }
  for (const std::uint32_t record : {0u, 77u, (1u << 30) - 1}) {
    EXPECT_TRUE(FrontState::in_band(record).is_in_band());
    EXPECT_FALSE(FrontState::in_band(record).passed_by(3e38f));
    EXPECT_EQ(FrontState::in_band(record).record(), record);
  }
  EXPECT_FALSE(FrontState::wall().passed_by(3e38f));
}

}  // namespace
}  // namespace supine::segmentation
