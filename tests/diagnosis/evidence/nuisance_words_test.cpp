// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/nuisance_words.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "diagnosis/evidence/nuisances.h"

namespace supine::diagnosis {
namespace {

TEST(NuisanceWords, TellEveryNuisanceApartAndNameItsPose) {
  const simulation::Model model;
  const std::vector<Nuisance> all = nuisances_of(model, {"prone", "supine", "tilt45"}, Priors{});
  ASSERT_GT(all.size(), 15u);
  std::set<std::string> told;
  for (const Nuisance& nuisance : all) {
    const std::string words = words_of(nuisance.name());
    EXPECT_EQ(words.find_first_of("_/{."), std::string::npos) << words;
    EXPECT_TRUE(told.insert(words).second) << words;
    if (!nuisance.pose.empty()) {
      EXPECT_NE(words.find(nuisance.pose), std::string::npos) << words;
    }
  }
  EXPECT_TRUE(told.count("where the supine scan lies, along x"));
}

TEST(NuisanceWords, SpellOutOtherParameters) {
  EXPECT_EQ(words_of("breast.young_modulus_kpa"), "breast young modulus");
  EXPECT_EQ(words_of("ligament.stiffness_kpa_per_mm"), "ligament stiffness");
}

TEST(FarNuisances, AreToldWithTheirSizeAndTheFurthestComesFirst) {
  std::vector<Nuisance> all = nuisances_of({}, {"prone", "supine"}, Priors{});
  for (Nuisance& nuisance : all) {
    if (nuisance.name() == "/gland_stiffness.log_ratio") nuisance.value = std::log(2.0) / nuisance.sigma;
    if (nuisance.name() == "supine/gravity_tilt.pitch_rad") nuisance.value = -1.6;
    if (nuisance.name() == "/interface.normal_kpa_per_mm") nuisance.value = 1.4;
    if (nuisance.name() == "supine/misregistration.shift_x_mm") nuisance.value = 5;
  }
  const std::vector<FarNuisance> far = far_nuisances(all);
  ASSERT_EQ(far.size(), 2u);
  EXPECT_EQ(far[0].in_words, "how stiff the gland is over fat: x 2 (2.3 sigma)");
  EXPECT_EQ(far[1].in_words, "which way is down in supine, head to feet: -3.2° (1.6 sigma)");
  EXPECT_EQ(too_far_words(all), "where the supine scan lies, along x ended 5.0 sigma from where it is expected");
}

TEST(FarNuisances, NoneIsTooFarUnderFourSigma) {
  std::vector<Nuisance> all = nuisances_of({}, {"prone", "supine"}, Priors{});
  all.back().value = -3.9;
  EXPECT_EQ(too_far_words(all), "");
  EXPECT_EQ(too_far_words({}), "");
}

}  // namespace
}  // namespace supine::diagnosis
