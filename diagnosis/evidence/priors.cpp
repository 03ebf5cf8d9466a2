// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/priors.h"

#include <cmath>
#include <numbers>

namespace supine::diagnosis {
namespace {

constexpr double degree = std::numbers::pi / 180;

// Of effects that are a nuisance made wider, in the unit of their numbers.
struct Width {
  const char *effect, *unit;
  double sd;
};
constexpr Width widths[] = {{"misregistration", "mm", 10},
                            {"misregistration", "rad", 8 * degree},
                            {"gravity_tilt", "rad", 10 * degree},
                            {"segmentation_offset", "mm", 1.5},
                            {"incompressibility", "1", 1.5}};

}  // namespace

simulation::MeasurementTolerances Priors::known_by_default() {
  simulation::MeasurementTolerances known;
  known.registration_mm = 2;
  known.registration_rad = 1.5 * degree;
  known.gravity_rad = 2 * degree;
  known.segmentation_mm = 0.3;
  known.chest_wall_mm = 1;
  known.incompressibility = 0.3;
  known.gland_log = 0.3;
  known.spring_log = std::numbers::ln2;
  return known;
}

double StrengthPrior::mean() const { return log_normal ? median * std::exp(0.5 * spread * spread) : median; }

double StrengthPrior::sd() const { return log_normal ? mean() * std::sqrt(std::expm1(spread * spread)) : spread; }

StrengthPrior strength_prior(const std::string& effect, const simulation::Parameter& row) {
  for (const Width& width : widths)
    if (effect == width.effect && row.unit == width.unit) return {row.median, width.sd, false};
  return {row.median, row.spread, row.one_sided};
}

}  // namespace supine::diagnosis
