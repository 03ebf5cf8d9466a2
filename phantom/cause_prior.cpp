// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/cause_prior.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "phantom/random.h"
#include "simulation/catalogue.h"

namespace supine::phantom {
namespace {

using simulation::Parameter;

// Log-normal where only positive values make sense, else normal.
double drawn(const Parameter& row, Random& random) {
  const double sd = simulation::prior_sd(row);
  const bool positive = row.one_sided || row.lower > 0;
  for (;;) {
    const double z = random.normal();
    const double value = positive ? row.median * std::pow(1 + sd / row.median, z) : row.median + sd * z;
    if (value >= row.lower && value <= row.upper) return value;
  }
}

std::size_t drawn_count(Random& random) {
  const double u = random.uniform();
  std::size_t count = 0;
  for (double sum = prior_of_sets[0]; count + 1 < std::size(prior_of_sets) && u >= sum; sum += prior_of_sets[count])
    ++count;
  return count;
}

}  // namespace

std::vector<Cause> draw_causes_from_prior(std::uint64_t seed) {
  Random random(seed, "set of causes");
  const std::size_t count = drawn_count(random);
  std::vector<std::string> names = catalogue_causes();
  std::vector<Cause> causes;
  for (std::size_t i = 0; i < count; ++i) {
    const auto chosen = names.begin() + static_cast<std::ptrdiff_t>(random.below(names.size()));
    causes.push_back(draw_cause_from_prior(*chosen, seed));
    names.erase(chosen);
  }
  return causes;
}

Cause draw_cause_from_prior(const std::string& name, std::uint64_t seed) {
  const simulation::Effect* effect = simulation::find_effect(name);
  if (effect == nullptr) throw InputError("the catalogue has no effect '" + name + "'");
  Random random(seed, "prior of " + name);
  Cause cause{.name = name, .by_catalogue = true};
  for (const Parameter& row : effect->parameters()) cause.values[row.name] = drawn(row, random);
  return cause;
}

}  // namespace supine::phantom
