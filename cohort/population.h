// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/likelihood.h"

namespace supine::cohort {

/// A middle and a 95 % interval.
struct Estimate {
  double value, low, high;
};

/// A number of a population, normal over its patients.
struct NormalPopulation {
  Estimate mean;      ///< of the patients
  Estimate spread;    ///< standard deviation between them
  Likelihood of_new;  ///< what it predicts for a patient who was not among them
  std::size_t patients = 0;
};

/// Mean and spread of a number over patients of whom each is known to within his likelihood (normal–normal hierarchical
/// model, Gelman et al., Bayesian Data Analysis, ch. 5.4), exact in the mean, on a grid in the spread. Priors: the mean
/// is normal around @p about, ten times as wide as @p wide; the spread half-normal with the scale @p wide.
/// @pre at least one patient, wide > 0
NormalPopulation pool_normal(const std::vector<Likelihood>& patients, double about, double wide);

/// What the patients' results say of one effect.
struct EffectEvidence {
  struct Patient {
    double ln_bayes_factor = 0;          ///< the effect alone against nothing missing, strengths by their prior
    std::optional<Likelihood> strength;  ///< of the strength, as an offset from the null; one-number effects alone
  };
  std::vector<Patient> patients;
  double prior_mean = 0, prior_sd = 1;  ///< of the strength in a patient who has it
  double null_sd = 0;  ///< of the number where the effect is not there: what is never known of it, 1 sigma, its unit
  /// 1 sigma of the strength that the model's own error, the same in all patients, pretends; 0: none.
  double shared_sd = 0;
};

/// How common an effect is.
struct Prevalence {
  double probability = 0;          ///< that any patient has it
  double ln_bayes_factor = 0;      ///< some have it against none has
  Estimate share;                  ///< of the patients who have it, if any
  std::optional<Estimate> mean;    ///< strength of those who have it, one-number effects alone, from the null
  std::optional<Estimate> shared;  ///< strength that the shared error pretends
  std::vector<double> in_patient;  ///< probability that each of them has it
};

/// Each patient has the effect with the probability π, and then a strength from N(m, w²); a shared error adds the same
/// δ ~ N(0, shared_sd²) to what is seen in everyone. Patients enter by their likelihoods: a case's own evidence times
/// the importance weight of the population's strengths over the prior's, so that no case is run again. Grid over π, m,
/// w and δ; π uniform, m ~ N(prior_mean, prior_sd²), w half-normal with half of prior_sd.
/// @param prior_probability  that the effect is in the population at all, 0 < p < 1
/// @pre at least one patient
Prevalence pool_effect(const EffectEvidence& evidence, double prior_probability);

}  // namespace supine::cohort
