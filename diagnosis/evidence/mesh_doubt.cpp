// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/mesh_doubt.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {

double mesh_doubt(const std::string& parameter) {
  constexpr double of_modulus = 0.15, of_shift_mm = 0.6, of_turn_rad = 0.35 * std::numbers::pi / 180;
  if (parameter == "breast.young_modulus_kpa" || parameter == "skin.young_modulus_kpa") return of_modulus;
  const simulation::Effect& place = simulation::place_of_scan();
  for (const simulation::Parameter& row : place.parameters())
    if (parameter == simulation::parameter_name(place, row)) return row.unit == "rad" ? of_turn_rad : of_shift_mm;
  return 0;
}

Known mixed(const std::vector<std::pair<double, Known>>& each) {
  double all = 0, mean = 0, square = 0;
  for (const auto& [probability, known] : each) {
    all += probability;
    mean += probability * known.mean;
    square += probability * (known.mean * known.mean + known.sd * known.sd);
  }
  mean /= all;
  return {mean, std::sqrt(std::max(square / all - mean * mean, 0.0))};
}

Known with_doubt(const Known& found, const Known& believed, double doubt) {
  const double before = 1 / (believed.sd * believed.sd), measured = 1 / (found.sd * found.sd) - before;
  if (!(measured > 0)) return believed;
  const double at = (found.mean / (found.sd * found.sd) - believed.mean * before) / measured;
  const double left = 1 / (1 / measured + doubt * doubt), all = before + left;
  return {(at * left + believed.mean * before) / all, 1 / std::sqrt(all)};
}

}  // namespace supine::diagnosis
