// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/priors.h"

#include <cmath>

namespace supine::diagnosis {

const simulation::MeasurementTolerances& Priors::known_in(const std::string& pose) const {
  const auto own = of_pose.find(pose);
  return own == of_pose.end() ? known : own->second.known;
}

double Priors::scan_shared_in(const std::string& pose) const {
  const auto own = of_pose.find(pose);
  return own == of_pose.end() ? scan_shared_mm : own->second.scan_shared_mm;
}

std::optional<double> Priors::independent_points_in(const std::string& pose) const {
  const auto own = of_pose.find(pose);
  return own == of_pose.end() ? std::nullopt : own->second.independent_points;
}

double StrengthPrior::mean() const { return log_normal ? median * std::exp(0.5 * spread * spread) : median; }

double StrengthPrior::sd() const { return log_normal ? mean() * std::sqrt(std::expm1(spread * spread)) : spread; }

StrengthPrior strength_prior(const simulation::Parameter& row) { return {row.median, row.spread, row.one_sided}; }

}  // namespace supine::diagnosis
