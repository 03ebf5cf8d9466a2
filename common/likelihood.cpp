// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/likelihood.h"

#include <cmath>

namespace supine {

std::optional<Likelihood> likelihood_of(const Likelihood& posterior, const std::optional<Likelihood>& prior) {
  if (!prior) return posterior;
  const double before = 1 / (prior->sd * prior->sd), after = 1 / (posterior.sd * posterior.sd);
  const double own = after - before;
  if (!(own > least_information * before)) return std::nullopt;
  return Likelihood{(posterior.mean * after - prior->mean * before) / own, 1 / std::sqrt(own)};
}

}  // namespace supine
