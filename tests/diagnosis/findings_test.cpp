// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include "diagnosis/examine.h"

namespace supine::diagnosis {
namespace {

Hypothesis hypothesis(const std::vector<int>& effects) {
  Hypothesis h;
  h.effects = effects;
  return h;
}

Unexplained left(double mm) {
  Unexplained unexplained;
  unexplained.mean_mm = mm;
  return unexplained;
}

TEST(Findings, TheLikeliestAreToldEachWithWhatItLeavesAndNothingIsOneOfThem) {
  Findings found;
  found.hypotheses = {hypothesis({}), hypothesis({2}), hypothesis({0, 1}), hypothesis({1})};
  found.unexplained_by = {left(1), left(2), left(3)};
  found.left_by_base = left(9);
  const auto told = found.told();
  ASSERT_EQ(told.size(), 3u);
  for (std::size_t h = 0; h < told.size(); ++h) {
    EXPECT_EQ(told[h].first, &found.hypotheses[h]);
    EXPECT_EQ(told[h].second.mean_mm, found.unexplained_by[h].mean_mm);
  }
}

TEST(Findings, NothingIsToldLastWhereItIsNotAmongTheLikeliest) {
  Findings found;
  found.hypotheses = {hypothesis({2}), hypothesis({0, 1}), hypothesis({})};
  found.unexplained_by = {left(1), left(2)};
  found.left_by_base = left(9);
  const auto told = found.told();
  ASSERT_EQ(told.size(), 3u);
  EXPECT_EQ(told.front().first, &found.hypotheses[0]);
  EXPECT_TRUE(told.back().first->effects.empty());
  EXPECT_EQ(told.back().second.mean_mm, 9);
}

TEST(Findings, RefitsAreFoundByTheirEffectsInAnyOrderWhereTheyWereSolved) {
  Findings found;
  Refit pair, failed;
  pair.effects = {"ligament", "gravity_tilt"}, pair.solved = true;
  failed.effects = {"friction"}, failed.solved = false;
  found.refits.push_back(std::move(pair)), found.refits.push_back(std::move(failed));
  EXPECT_EQ(found.refit_of({"gravity_tilt", "ligament"}), &found.refits[0]);
  EXPECT_EQ(found.refit_of({"ligament"}), nullptr);
  EXPECT_EQ(found.refit_of({"friction"}), nullptr);
}

TEST(Budget, AFinerMeshIsAskedForWhereTheMeshErrsMost) {
  ErrorBudget large{.noise = 0.73, .registration = 0.74, .numerical = 1.36, .parameters = 0.8, .patchiness = 1.01};
  EXPECT_TRUE(mesh_errs_most(large));
  for (double ErrorBudget::*other : {&ErrorBudget::noise, &ErrorBudget::registration, &ErrorBudget::parameters,
                                     &ErrorBudget::patchiness, &ErrorBudget::model_form}) {
    ErrorBudget usual = large;
    usual.*other = 1.4;
    EXPECT_FALSE(mesh_errs_most(usual));
  }
}

}  // namespace
}  // namespace supine::diagnosis
