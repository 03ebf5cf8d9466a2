// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

namespace supine {

/// What a measurement says of one number, as a normal likelihood.
struct Likelihood {
  double mean, sd;
};

/// Part of the information of what is known beforehand below which a measurement says nothing.
inline constexpr double least_information = 0.01;

/// The likelihood behind a normal posterior, its prior taken out again: 1/sd² = 1/posterior² − 1/prior². Only where
/// the posterior holds the prior at its full weight, which the intervals of a sandwich covariance do not.
/// @param prior  none: the posterior is the likelihood
/// @return none where the posterior says no more than a hundredth of what the prior does
std::optional<Likelihood> likelihood_of(const Likelihood& posterior, const std::optional<Likelihood>& prior);

}  // namespace supine
