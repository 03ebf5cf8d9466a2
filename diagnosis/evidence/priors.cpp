// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/priors.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace supine::diagnosis {
namespace {

double binomial(std::size_t n, std::size_t k) {
  double value = 1;
  for (std::size_t i = 0; i < k; ++i) value *= static_cast<double>(n - i) / static_cast<double>(i + 1);
  return value;
}

std::size_t count_expected(const Priors& priors, const std::vector<std::string>& effects) {
  return static_cast<std::size_t>(std::count_if(
      effects.begin(), effects.end(), [&priors](const std::string& effect) { return priors.is_expected(effect); }));
}

constexpr simulation::MeasurementTolerances exact{0, 0, 0, 0, 0, 0, 0, 0};

}  // namespace

bool Priors::is_expected(const std::string& effect) const {
  return std::find(expected.begin(), expected.end(), effect) != expected.end();
}

double Priors::ln_of_set(const std::vector<std::string>& effects, const std::vector<int>& set) const {
  const std::size_t expected_ones = count_expected(*this, effects);
  const auto others = static_cast<std::size_t>(std::count_if(
      set.begin(), set.end(), [&](int row) { return !is_expected(effects[static_cast<std::size_t>(row)]); }));
  return static_cast<double>(expected_ones) * std::log(0.5) +
         std::log(of_sets.at(others) / binomial(effects.size() - expected_ones, others));
}

double Priors::of_effect(const std::vector<std::string>& effects, const std::string& effect) const {
  if (is_expected(effect)) return 0.5;
  const auto others = static_cast<double>(effects.size() - count_expected(*this, effects));
  double sum = 0;
  for (std::size_t size = 1; size < of_sets.size(); ++size) sum += of_sets[size] * static_cast<double>(size) / others;
  return sum;
}

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

Priors without(Allowance what, Priors priors) {
  constexpr double next_to_nothing_mm = std::numeric_limits<double>::min();
  switch (what) {
    case Allowance::discrepancy:
      priors.least_unexplained_mm = next_to_nothing_mm;
      priors.share_of_way = 0;
      break;
    case Allowance::nuisances:
      priors.known = exact;
      for (auto& [pose, own] : priors.of_pose) own.known = exact;
      break;
    case Allowance::patchiness:
      priors.patchiness.tissue = priors.patchiness.skin = priors.patchiness.muscle_mm = 0;
      priors.unlisted = 0;
      break;
  }
  return priors;
}

double StrengthPrior::mean() const { return log_normal ? median * std::exp(0.5 * spread * spread) : median; }

double StrengthPrior::sd() const { return log_normal ? mean() * std::sqrt(std::expm1(spread * spread)) : spread; }

StrengthPrior strength_prior(const simulation::Parameter& row) { return {row.median, row.spread, row.one_sided}; }

}  // namespace supine::diagnosis
