// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/cmaes.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/error.h"
#include "tests/calibration/twin.h"

namespace supine::calibration {
namespace {

using supine::testing::Twin;

/// Whole triangles, so that the skin's points find the scan inside of it.
const Twin& covered_twin() {
  static const Twin twin = [] {
    Twin::Options options{supine::testing::twin_truth()};
    options.shrink = 1;
    return Twin(options);
  }();
  return twin;
}

simulation::Model start() {
  simulation::Model model = supine::testing::twin_start();
  model.breast.young_modulus_kpa.prior_sd = 0.2;
  model.skin.young_modulus_kpa.prior_sd = 15;
  return model;
}

CmaesResult search(int threads, const CmaesOptions& options, RunJournal& journal) {
  static const FreeParameters parameters(start());
  EvaluatorPool pool(covered_twin().scene(), parameters, covered_twin().solution, threads);
  return minimise_cmaes(pool, parameters, options, journal);
}

class CmaesFiles : public ::testing::Test {
 protected:
  CmaesFiles() { std::filesystem::remove(file_); }
  ~CmaesFiles() override { std::filesystem::remove(file_); }
  const std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("supine_cmaes_" + std::to_string(::getpid()) + ".runs");
};

void expect_same(const CmaesResult& a, const CmaesResult& b) {
  ASSERT_EQ(a.history.size(), b.history.size());
  for (std::size_t i = 0; i < a.history.size(); ++i) {
    EXPECT_EQ(a.history[i].values, b.history[i].values) << i;
    EXPECT_EQ(a.history[i].mae_study_mm, b.history[i].mae_study_mm) << i;
  }
  EXPECT_EQ(a.values, b.values);
}

TEST(Cmaes, StartsWithTheModelsSpreadAndComesNearTheTruth) {
  CmaesOptions options;
  options.max_evaluations = 120;
  options.until_mae_mm = 0.05;
  RunJournal none;
  const CmaesResult result = search(2, options, none);
  EXPECT_TRUE(result.target_met) << result.mae_study_mm;
  EXPECT_NEAR(result.values[0], 0.9, 0.1);
  // The first generation: 6 draws of N(start, prior_sd).
  Eigen::Vector2d square = Eigen::Vector2d::Zero();
  for (int i = 0; i < 6; ++i)
    square += (result.history[static_cast<std::size_t>(i)].values - Eigen::Vector2d(0.7, 40))
                  .cwiseQuotient(Eigen::Vector2d(0.2, 15))
                  .cwiseAbs2();
  EXPECT_GT(square.minCoeff() / 6, 0.1);  // χ² with 6 degrees: 0.1 and 3.7 are beyond one in a thousand
  EXPECT_LT(square.maxCoeff() / 6, 3.7);
}

TEST_F(CmaesFiles, SameBytesForAnyThreadsAndWhenResumed) {
  CmaesOptions options;
  options.max_evaluations = 18;
  options.seed = 5;
  RunJournal none;
  const CmaesResult one = search(1, options, none);
  RunJournal again;
  expect_same(one, search(2, options, again));
  {
    CmaesOptions interrupted = options;
    interrupted.max_evaluations = 8;
    RunJournal journal(file_, "key");
    search(2, interrupted, journal);
  }
  RunJournal resumed(file_, "key");
  EXPECT_GE(resumed.known(), 8u);
  expect_same(one, search(2, options, resumed));
}

TEST(Cmaes, OtherSeedOtherDraws) {
  CmaesOptions options;
  options.max_evaluations = 6;
  RunJournal a, b;
  const CmaesResult first = search(2, options, a);
  options.seed = 2;
  EXPECT_NE(first.history[0].values, search(2, options, b).history[0].values);
}

TEST(Cmaes, RefusesOptionsThatMeanNothing) {
  RunJournal none;
  CmaesOptions options;
  options.population = 3;
  EXPECT_THROW(search(1, options, none), InputError);
  options = {};
  options.max_evaluations = 0;
  EXPECT_THROW(search(1, options, none), InputError);
  options = {};
  options.until_mae_mm = 0.0;
  EXPECT_THROW(search(1, options, none), InputError);
}

TEST_F(CmaesFiles, JournalForgetsOtherWorkAndHalfALine) {
  const Eigen::VectorXd values = Eigen::Vector2d(0.1, 1.0 / 3);
  {
    RunJournal journal(file_, "first");
    journal.add(values, {false, 1.0 / 7, 2, 3});
  }
  {
    RunJournal journal(file_, "first");
    ASSERT_TRUE(journal.find(values));
    EXPECT_EQ(journal.find(values)->mae_study_mm, 1.0 / 7);
    EXPECT_FALSE(journal.find(Eigen::Vector2d(0.1, 0.3333)));
  }
  std::ofstream(file_, std::ios::app) << "0 0.5 1 2 | 0.25 0.";  // the program was stopped here
  EXPECT_EQ(RunJournal(file_, "first").known(), 1u);
  EXPECT_EQ(RunJournal(file_, "second").known(), 0u);
}

}  // namespace
}  // namespace supine::calibration
