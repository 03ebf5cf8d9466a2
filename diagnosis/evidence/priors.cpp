// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/priors.h"

#include <cmath>

namespace supine::diagnosis {

double StrengthPrior::mean() const { return log_normal ? median * std::exp(0.5 * spread * spread) : median; }

double StrengthPrior::sd() const { return log_normal ? mean() * std::sqrt(std::expm1(spread * spread)) : spread; }

StrengthPrior strength_prior(const simulation::Parameter& row) { return {row.median, row.spread, row.one_sided}; }

}  // namespace supine::diagnosis
