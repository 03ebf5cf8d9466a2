// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/over_sets.h"

#include <algorithm>
#include <cmath>

#include "common/statistics.h"

namespace supine::diagnosis {
namespace {

struct Part {
  double probability;
  const FittedParameter* number;
};

/// Of two halves of normals that meet at the value.
double share_below(const FittedParameter& number, double x) {
  const double below = (number.value - number.low) / normal_reach95(),
               above = (number.high - number.value) / normal_reach95();
  const double spread = x < number.value ? below : above;
  if (below + above <= 0 || spread <= 0) return x < number.value ? 0 : 1;
  const double tail = std::erfc(std::abs(x - number.value) / spread / std::sqrt(2.0)) * spread / (below + above);
  return x < number.value ? tail : 1 - tail;
}

double quantile_of(const std::vector<Part>& parts, double share) {
  double low = parts.front().number->low, high = parts.front().number->high, sum = 0;
  for (const Part& part : parts) {
    const double reach = part.number->high - part.number->low;
    low = std::min(low, part.number->low - reach);
    high = std::max(high, part.number->high + reach);
    sum += part.probability;
  }
  constexpr int halvings = 60;
  for (int i = 0; i < halvings; ++i) {
    const double middle = (low + high) / 2;
    double below = 0;
    for (const Part& part : parts) below += part.probability / sum * share_below(*part.number, middle);
    (below < share ? low : high) = middle;
  }
  return (low + high) / 2;
}

double probability_of(const Findings& found, const Refit& refit) {
  const std::vector<std::string> names = found.effects();
  for (const Hypothesis& h : found.hypotheses) {
    if (h.effects.size() != refit.effects.size()) continue;
    if (std::all_of(h.effects.begin(), h.effects.end(), [&](int row) {
          return std::find(refit.effects.begin(), refit.effects.end(), names[static_cast<std::size_t>(row)]) !=
                 refit.effects.end();
        }))
      return h.probability;
  }
  return 0;
}

}  // namespace

std::vector<FittedParameter> over_sets(const Findings& found, const std::string& effect) {
  std::vector<FittedParameter> numbers;
  std::vector<std::vector<Part>> parts;
  int holding = 0;
  for (const Refit& refit : found.refits) {
    if (!refit.solved || std::find(refit.effects.begin(), refit.effects.end(), effect) == refit.effects.end()) continue;
    const double probability = probability_of(found, refit);
    if (probability <= 0) continue;
    ++holding;
    for (const FittedParameter& number : refit.parameters) {
      if (!number.name.starts_with(effect + ".")) continue;
      const auto known = std::find_if(numbers.begin(), numbers.end(),
                                      [&number](const FittedParameter& n) { return n.name == number.name; });
      const auto row = static_cast<std::size_t>(known - numbers.begin());
      if (known == numbers.end()) {
        numbers.push_back({number.name, number.unit, 0, 0, 0});
        parts.emplace_back();
      }
      parts[row].push_back({probability, &number});
    }
  }
  if (holding < 2) return {};
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    constexpr double tail = 0.025;
    numbers[k].value = quantile_of(parts[k], 0.5);
    numbers[k].low = quantile_of(parts[k], tail);
    numbers[k].high = quantile_of(parts[k], 1 - tail);
  }
  return numbers;
}

}  // namespace supine::diagnosis
