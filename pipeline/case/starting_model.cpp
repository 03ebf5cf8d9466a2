// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/starting_model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "simulation/parameters.h"
#include "simulation/solve/chain.h"

namespace supine::pipeline {
namespace {

// Real breasts of 150 to 160 mm over their muscle found every pose at 0.4, not all of them at 0.8 (docs/imaging.md).
constexpr double load_number = 0.4;
constexpr double density_kg_m3 = 1000;
constexpr double spread = 10;  // bounds, up and down

double two_digits(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

}  // namespace

std::string starting_model(double mound_height_mm) {
  meshing::Anatomy body;
  body.mound_height_mm = mound_height_mm;
  simulation::Model of_one_kpa;
  of_one_kpa.breast.density_kg_m3.value = density_kg_m3;
  of_one_kpa.breast.young_modulus_kpa.value = 1;
  const double modulus_kpa = two_digits(simulation::load_number(body, of_one_kpa) / load_number);
  const simulation::Parameter& range = *simulation::find_parameter("breast.young_modulus_kpa");
  if (!(modulus_kpa >= range.lower && modulus_kpa <= range.upper))
    throw InputError(
        fmt::format("a body {:.1f} mm high would start from {:.2g} kPa; moduli lie in [{:g}, {:g}]: are its "
                    "coordinates in mm?",
                    mound_height_mm, modulus_kpa, range.lower, range.upper));
  return fmt::format(
      R"(# A start, not a measurement: the breast is {:.0f} mm high over its muscle, and under {:g} kPa it carries its weight.
[breast]
law = "neo_hookean"
young_modulus_kpa = {{ value = {:g}, prior_sd = {:g}, lower = {:g}, upper = {:g} }}
density_kg_m3 = {:g}
[skin]
law = "neo_hookean"
young_modulus_kpa = {{ value = 20, prior_sd = 20, lower = 0.5, upper = 300 }}
thickness_mm = 1.5
[interface]
kind = "sliding"
[cut]
kind = "elastic"
)",
      mound_height_mm, modulus_kpa, modulus_kpa, 0.8 * modulus_kpa, std::max(range.lower, modulus_kpa / spread),
      std::min(range.upper, modulus_kpa * spread), density_kg_m3);
}

}  // namespace supine::pipeline
