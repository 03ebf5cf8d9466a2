// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/nuisance_words.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace supine::diagnosis
