// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/side_by_side.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <atomic>
#include <stdexcept>
#include <string>

namespace supine {
namespace {

/// With so many threads, whatever the machine has.
class SideBySide : public ::testing::TestWithParam<int> {
 protected:
  SideBySide() : before_(omp_get_max_threads()) { omp_set_num_threads(GetParam()); }
  ~SideBySide() override { omp_set_num_threads(before_); }

 private:
  int before_;
};

std::vector<std::function<void()>> that_count(std::vector<std::atomic<int>>& done) {
  std::vector<std::function<void()>> works;
  for (std::atomic<int>& one : done) works.emplace_back([&one] { ++one; });
  return works;
}

TEST_P(SideBySide, DoesEveryWorkOnce) {
  for (const std::size_t count : {0, 1, 2, 7}) {
    std::vector<std::atomic<int>> done(count);
    side_by_side(that_count(done));
    for (const auto& one : done) EXPECT_EQ(one, 1);
  }
}

TEST_P(SideBySide, DoesItInsideOfALoopAndOfItself) {
  std::vector<std::atomic<int>> done(6);
#pragma omp parallel for schedule(dynamic, 1)
  for (int i = 0; i < 4; ++i) side_by_side({[&done] { side_by_side(that_count(done)); }, [&done] { ++done[0]; }});
  EXPECT_EQ(done[0], 8);
  for (std::size_t i = 1; i < done.size(); ++i) EXPECT_EQ(done[i], 4);
}

TEST_P(SideBySide, ThrowsTheFirstInTheListAndDoesTheRest) {
  std::atomic<int> done = 0;
  const auto fail = [](const std::string& name) { return [name] { throw std::runtime_error(name); }; };
  try {
    side_by_side({[&done] { ++done; }, fail("second"), fail("third"), [&done] { ++done; }});
    FAIL() << "nothing was thrown";
  } catch (const std::runtime_error& failure) {
    EXPECT_STREQ(failure.what(), "second");
  }
  EXPECT_EQ(done, 2);
}

INSTANTIATE_TEST_SUITE_P(Threads, SideBySide, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace supine
