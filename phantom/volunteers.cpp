// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/volunteers.h"

#include <cmath>

#include "phantom/random.h"

namespace supine::phantom {
namespace {

/// Normal, drawn again outside the range.
double normal_within(Random& random, double mean, double sd, double lower, double upper) {
  double value = 0;
  do value = mean + sd * random.normal();
  while (value < lower || value > upper);
  return value;
}

/// Log-normal about a median, drawn again outside the range.
double log_normal_within(Random& random, double median, double log_sd, double lower, double upper) {
  return std::exp(normal_within(random, std::log(median), log_sd, std::log(lower), std::log(upper)));
}

}  // namespace

Volunteer draw_volunteer(std::uint64_t seed) {
  Random random(seed, "volunteer");
  Volunteer drawn;
  // 63 volunteers: median 96 mm, quartiles 80 and 118, which is 0.288 of the logarithm.
  drawn.nipple_moves_mm = log_normal_within(random, 96, 0.288, 45, 200);
  drawn.foot_radius_mm = normal_within(random, 76, 7, 55, 85);
  // Of two breasts that move otherwise the larger moves further.
  drawn.height_mm = normal_within(random, 80 * std::pow(drawn.nipple_moves_mm / 96, 0.6), 8, 30, 110);
  // A breast that stands higher over its foot must be stiffer to be carried at all.
  const double slender = std::log(drawn.height_mm / drawn.foot_radius_mm);
  drawn.breast_kpa =
      log_normal_within(random, 0.38 * std::exp(1.2 * slender), 0.2, softest_breast_kpa, stiffest_breast_kpa);
  drawn.skin_kpa = log_normal_within(random, 23 * std::exp(slender), 0.3, softest_skin_kpa, stiffest_skin_kpa);
  return drawn;
}

}  // namespace supine::phantom
