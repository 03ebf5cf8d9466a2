// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/curved_density.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/statistics.h"
#include "diagnosis/evidence/strength_profile.h"

namespace supine::diagnosis {
namespace {

constexpr double everywhere = std::numeric_limits<double>::infinity();

template <class Ln>
CurvedDensity sampled(Ln ln, std::vector<double> at, double lower, double upper) {
  std::vector<double> values;
  for (const double u : at) values.push_back(ln(u));
  return {at, values, lower, upper};
}

TEST(CurvedDensity, OfANormalOneMassAndQuantilesAreThoseOfTheFormula) {
  constexpr double mean = -1.3, sd = 0.4, factor = 12;
  const auto ln = [](double u) { return factor - 0.5 * std::pow((u - mean) / sd, 2); };
  const auto density =
      sampled(ln, {mean - 3 * sd, mean - 1.5 * sd, mean, mean + 1.5 * sd, mean + 3 * sd}, -everywhere, everywhere);
  EXPECT_NEAR(density.ln_mass(), factor + std::log(sd * std::sqrt(2 * std::numbers::pi)), 0.05);
  for (const double p : {0.025, 0.5, 0.975}) EXPECT_NEAR(density.quantile(p), mean + sd * normal_quantile(p), 0.1 * sd);
}

// A strength that saturates: above, the measurement says no more, and the prior alone ends the density.
TEST(CurvedDensity, ATailThatLaplacesFormulaDoesNotSeeCounts) {
  const auto ln = [](double u) { return -0.5 * std::pow(3 / (1 + std::exp(2 * u)), 2) - 0.5 * u * u / 4; };
  double mass = 0, above = 0;
  for (double u = -12; u < 12; u += 1e-3) mass += 1e-3 * std::exp(ln(u)), above += u > 3 ? 1e-3 * std::exp(ln(u)) : 0;
  const auto density = sampled(ln, {-2.2, -1, 0.2, 1.4, 2.6, 3.8, 5}, -everywhere, everywhere);
  EXPECT_NEAR(density.ln_mass(), std::log(mass), 0.03);
  EXPECT_NEAR(density.quantile(1 - above / mass), 3, 0.15);
}

TEST(CurvedDensity, NothingLiesBeyondTheRange) {
  const auto density = sampled([](double) { return 2.0; }, {0, 1, 2, 3}, -0.5, 3.5);
  EXPECT_NEAR(density.ln_mass(), 2 + std::log(4), 1e-9);
  EXPECT_NEAR(density.quantile(0.25), 0.5, 1e-9);
  EXPECT_NEAR(density.quantile(0.999), 3.5, 0.01);
}

TEST(CurvedDensity, DoesNotRiseBeyondItsPlaces) {
  const auto rising = sampled([](double u) { return 10 * u; }, {0, 1, 2, 3}, -1, 8);
  EXPECT_LT(rising.ln_mass(), 30 + std::log(8 - 3 + 1));
  EXPECT_GT(rising.quantile(0.5), 3);
  const auto falling = sampled([](double u) { return -10 * u; }, {0, 1, 2, 3}, -5, 4);
  EXPECT_LT(falling.ln_mass(), std::log(5 + 1));
  EXPECT_LT(falling.quantile(0.5), 0);
}

TEST(PriorAlone, GoesOnFromTheLastPlaceAsThePriorDoesAndNoFurtherThanTheRange) {
  const calibration::Prior prior{1, 2};  // mean, standard deviation
  for (const double side : {1.0, -1.0}) {
    const double last = prior.mean + 0.5 * side, bound = prior.mean + 100 * side;
    const auto places = prior_alone(last, 7, 0.1 * side, bound, prior);
    ASSERT_GT(places.size(), 4u);
    for (const auto& [u, ln] : places) {
      const double z = (u - prior.mean) / prior.sd, from = 0.5 / prior.sd;
      EXPECT_NEAR(ln, 7 - 0.5 * (z * z - from * from), 1e-12);
    }
    EXPECT_NEAR(places[0].first - last, side, 1e-12) << "half a standard deviation";
    EXPECT_NEAR(places.back().first, prior.mean + 8.5 * side, 1e-12) << "beyond four of them";
    EXPECT_EQ(prior_alone(last, 7, 0.1 * side, last + 2.5 * side, prior).size(), 2u) << "inside the range";
  }
}

TEST(CurvedDensity, FewerThanFourPlacesOrDisorderAreRefused) {
  EXPECT_THROW(CurvedDensity({0, 1, 2}, {0, 0, 0}, 0, 2), std::invalid_argument);
  EXPECT_THROW(CurvedDensity({0, 1, 1, 2}, {0, 0, 0, 0}, 0, 2), std::invalid_argument);
}

}  // namespace
}  // namespace supine::diagnosis
