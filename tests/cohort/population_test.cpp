// SPDX-License-Identifier: AGPL-3.0-or-later
#include "cohort/population.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace supine::cohort {
namespace {

double ln_normal(double x, double variance) { return -0.5 * (x * x / variance + std::log(2 * M_PI * variance)); }

/// A computed cohort: what each patient's measurement says of an effect whose usual strength is 1 with a spread of 0.5.
struct Population {
  double share = 0, strength = 1, spread = 0.2, shared = 0, noise = 0.45;
};

EffectEvidence measure(const Population& population, int patients, double believed_shared, std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  EffectEvidence e;
  e.prior_mean = 1, e.prior_sd = 0.5, e.shared_sd = believed_shared;
  const double error = population.shared * normal(generator);
  for (int i = 0; i < patients; ++i) {
    const bool has = uniform(generator) < population.share;
    const double truth = has ? population.strength + population.spread * normal(generator) : 0;
    const double seen = truth + error + population.noise * normal(generator),
                 variance = population.noise * population.noise;
    const double factor =
        ln_normal(seen - e.prior_mean, variance + e.prior_sd * e.prior_sd) - ln_normal(seen, variance);
    e.patients.push_back({factor, Likelihood{seen, population.noise}});
  }
  return e;
}

TEST(Population, APosteriorGivesItsLikelihoodBack) {
  const Likelihood prior{1, 2}, likelihood{3, 0.5};
  const double information = 1 / 4.0 + 1 / 0.25;
  const Likelihood posterior{(1 / 4.0 + 3 / 0.25) / information, 1 / std::sqrt(information)};
  const auto back = likelihood_of(posterior, prior);
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->mean, likelihood.mean, 1e-12);
  EXPECT_NEAR(back->sd, likelihood.sd, 1e-12);
  EXPECT_FALSE(likelihood_of(prior, prior)) << "a posterior that is the prior says nothing";
  EXPECT_EQ(likelihood_of(posterior, std::nullopt)->sd, posterior.sd);
}

TEST(Population, MeanAndSpreadOfAKnownPopulationLieInTheirIntervals) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  constexpr double mean = -0.4, spread = 0.35;
  int mean_inside = 0, spread_inside = 0, new_inside = 0;
  constexpr int cohorts = 200;
  for (int c = 0; c < cohorts; ++c) {
    std::vector<Likelihood> patients;
    for (int i = 0; i < 30; ++i) {
      const double sd = 0.2 + 0.02 * i;
      patients.push_back({mean + spread * normal(generator) + sd * normal(generator), sd});
    }
    const NormalPopulation found = pool_normal(patients, 0, 0.5);
    mean_inside += found.mean.low < mean && mean < found.mean.high;
    spread_inside += found.spread.low < spread && spread < found.spread.high;
    new_inside += std::abs(mean + spread * normal(generator) - found.of_new.mean) < 1.96 * found.of_new.sd;
  }
  EXPECT_GE(mean_inside, 0.91 * cohorts);
  EXPECT_GE(spread_inside, 0.91 * cohorts);
  EXPECT_GE(new_inside, 0.91 * cohorts);
  EXPECT_LT(mean_inside, cohorts) << "intervals that always hold the truth are too wide";
}

TEST(Population, WherePatientsAreKnownExactlyTheMeanIsTheirs) {
  const NormalPopulation found = pool_normal({{1, 1e-6}, {2, 1e-6}, {3, 1e-6}, {4, 1e-6}}, 0, 1);
  EXPECT_NEAR(found.mean.value, 2.5, 0.05);
  EXPECT_GT(found.spread.value, 0.8);
  EXPECT_GT(found.of_new.sd, found.spread.value);
}

TEST(Population, WhoseDataSayLittleChangesLittle) {
  const std::vector<Likelihood> three = {{-0.7, 0.2}, {-0.75, 0.2}, {-0.8, 0.2}};
  std::vector<Likelihood> four = three;
  four.push_back({3, 20});
  const NormalPopulation known = pool_normal(three, 0.7, 0.5), with = pool_normal(four, 0.7, 0.5);
  EXPECT_NEAR(known.mean.value, -0.75, 0.02);
  EXPECT_NEAR(with.mean.value, known.mean.value, 0.02);
  EXPECT_NEAR(with.mean.high - with.mean.low, known.mean.high - known.mean.low, 0.02);
}

/// A third or less of what one patient shows surely, in 60 % of thirty.
TEST(Population, AWeakEffectThatNoPatientShowsIsFoundAndItsShareIsInTheInterval) {
  std::mt19937_64 generator(11);
  const Population weak{0.6, 0.9, 0.2, 0.05, 0.45};
  int found_it = 0, inside = 0, seen_alone = 0, patients = 0;
  constexpr int cohorts = 40;
  for (int c = 0; c < cohorts; ++c) {
    const EffectEvidence e = measure(weak, 30, 0.05, generator);
    for (const auto& p : e.patients) seen_alone += p.ln_bayes_factor > std::log(19 / 0.03), ++patients;
    const Prevalence found = pool_effect(e, 0.1);
    found_it += found.probability > 0.95;
    inside += found.share.low < weak.share && weak.share < found.share.high;
  }
  EXPECT_LT(seen_alone, 0.1 * patients) << "the effect is not weak";
  EXPECT_GE(found_it, 38);
  EXPECT_GE(inside, 38) << "19 of 20";
}

TEST(Population, CohortsThatLackNothingStayQuiet) {
  std::mt19937_64 generator(12);
  int named = 0;
  for (int c = 0; c < 40; ++c) named += pool_effect(measure({}, 30, 0.05, generator), 0.1).probability > 0.95;
  EXPECT_LE(named, 1);
}

/// The same error of the model in everyone looks like an effect in everyone. Only a term for it keeps the answer
/// honest.
TEST(Population, AnErrorThatAllPatientsShareIsNotTakenForAnEffect) {
  std::mt19937_64 generator(13);
  const Population shared{0, 1, 0.2, 0.3, 0.45};
  int with_term = 0, without_term = 0;
  for (int c = 0; c < 40; ++c) {
    const EffectEvidence e = measure(shared, 30, 0.3, generator);
    EffectEvidence ignorant = e;
    ignorant.shared_sd = 0;
    with_term += pool_effect(e, 0.1).probability > 0.95;
    without_term += pool_effect(ignorant, 0.1).probability > 0.95;
  }
  EXPECT_LE(with_term, 2);
  EXPECT_GT(without_term, 8) << "the term is not needed here: the test shows nothing";
}

TEST(Population, WithoutStrengthsBayesFactorsAloneGiveTheShare) {
  EffectEvidence e;
  for (int i = 0; i < 40; ++i) e.patients.push_back({i < 10 ? 20.0 : -20.0, std::nullopt});
  const Prevalence found = pool_effect(e, 0.1);
  // Ten of forty for sure: the posterior of the share is Beta(11, 31).
  EXPECT_NEAR(found.share.value, 0.2602, 0.01);
  EXPECT_NEAR(found.share.low, 0.1413, 0.01);
  EXPECT_NEAR(found.share.high, 0.4040, 0.01);
  EXPECT_GT(found.in_patient[0], 0.99);
  EXPECT_LT(found.in_patient[39], 0.01);
  EXPECT_FALSE(found.mean);
}

TEST(Population, ANumberThatIsNeverKnownAndNearItsExpectationInAllIsNoEffect) {
  // Nobody has it, and the number is nearer to its null in everyone than a case takes for granted.
  constexpr double seen_sd = 0.2, prior_sd = 1.0, null_sd = 0.3;
  EffectEvidence evidence;
  evidence.prior_mean = 0, evidence.prior_sd = prior_sd;
  std::mt19937_64 engine(5);
  std::normal_distribution<double> seen(0, seen_sd);
  for (int i = 0; i < 30; ++i) {
    const double x = seen(engine);
    evidence.patients.push_back(
        {ln_normal(x, seen_sd * seen_sd + prior_sd * prior_sd) - ln_normal(x, seen_sd * seen_sd + null_sd * null_sd),
         Likelihood{x, seen_sd}});
  }
  EXPECT_GT(pool_effect(evidence, 0.1).probability, 0.95) << "what a population narrower than that pretends";
  evidence.null_sd = null_sd;
  EXPECT_LT(pool_effect(evidence, 0.1).probability, 0.2);
}

}  // namespace
}  // namespace supine::cohort
