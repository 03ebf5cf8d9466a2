// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/cheapest_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace supine::segmentation {
namespace {

double total(const SurfaceProblem& p, const std::vector<int>& chosen) {
  double sum = 0;
  for (int row = 0; row < p.rows; ++row)
    for (int ray = 0; ray < p.rays; ++ray) {
      const int node = row * p.rays + ray;
      sum += p.costs[static_cast<std::size_t>(node) * p.samples + chosen[node]];
      if (ray > 0) sum += p.ray_slope * std::abs(chosen[node] - chosen[node - 1]);
      if (row > 0) sum += std::min(p.row_most, p.row_slope * std::abs(chosen[node] - chosen[node - p.rays]));
    }
  return sum;
}

/// By trying every choice.
double cheapest_of_all(const SurfaceProblem& p) {
  std::vector<int> chosen(static_cast<std::size_t>(p.rays) * p.rows, 0);
  double best = INFINITY;
  for (;;) {
    best = std::min(best, total(p, chosen));
    std::size_t n = 0;
    while (n < chosen.size() && ++chosen[n] == p.samples) chosen[n++] = 0;
    if (n == chosen.size()) return best;
  }
}

TEST(CheapestSurface, IsTheBestOfAllChoices) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SurfaceProblem p{3, 3, 4, {}, 0.3, 0.2, 10};
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> cost(0, 1);
    for (int n = 0; n < 36; ++n) p.costs.push_back(cost(random));
    EXPECT_NEAR(total(p, cheapest_surface(p)), cheapest_of_all(p), 1e-5) << seed;
  }
}

TEST(CheapestSurface, AFalseLineOnAFewRowsDoesNotLeadItAway) {
  SurfaceProblem p{20, 15, 30, {}, 0.2, 0.2, 100};
  for (int row = 0; row < 15; ++row)
    for (int ray = 0; ray < 20; ++ray)
      for (int i = 0; i < 30; ++i) p.costs.push_back(i == 10 ? 0.5f : i == 25 && row >= 6 && row < 9 ? 0.0f : 1.0f);
  for (const int i : cheapest_surface(p)) EXPECT_EQ(i, 10);
  p.row_slope = 0;  // each row for itself follows it
  EXPECT_EQ(cheapest_surface(p)[7 * 20 + 10], 25);
}

}  // namespace
}  // namespace supine::segmentation
