// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/cause.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>

#include "common/error.h"
#include "phantom/random.h"

namespace supine::phantom {
namespace {

using How = Draw::How;
constexpr double turn = 2 * std::numbers::pi;

struct Row {
  std::string name;
  bool outside;
  std::vector<Draw> draws;
};

const Draw uneven{"unevenness", How::uniform, 0.0, 0.25, true},
    uneven_at{"unevenness_at_rad", How::uniform, 0, turn, true};

const std::vector<Row>& rows() {
  static const std::vector<Row> all = {
      {"adhesion", false, {{"log_factor", How::uniform, 1.5, 4}, uneven, uneven_at}},
      {"ligament",
       false,
       {{"stiffness_kpa_per_mm", How::log_uniform, 0.2, 1.2},
        {"offset_mm", How::uniform, -5, 5},
        {"width_mm", How::log_uniform, 9, 17},
        {"wave_mm", How::uniform, 0, 2, true},
        {"wave_at_rad", How::uniform, 0, turn, true}}},
      {"friction", false, {{"coefficient", How::uniform, 0.1, 0.5}}},
      {"strain_stiffening", false, {{"exponent", How::log_uniform, 0.8, 2.5}}},
      {"fibre_anisotropy", false, {{"stiffness_kpa", How::log_uniform, 0.3, 1.5}, uneven, uneven_at}},
      {"incompressibility", false, {{"log_factor", How::uniform, 1, 3}}},
      {"gland_stiffness", false, {{"log_ratio", How::uniform, 0.9, 2.3}}},
      {"tumour_stiffness", false, {{"log_ratio", How::uniform, 1, 2.5}}},
      {"stiffness_gradient",
       false,
       {{"lateral", How::direction, 0.4, 1}, {"head", How::direction, 0.4, 1}, {"curve", How::uniform, 0, 0.8, true}}},
      {"skin_prestretch", false, {{"excess", How::uniform, 0.06, 0.2}, uneven, uneven_at}},
      {"skin_stiffening", false, {{"exponent", How::log_uniform, 0.8, 4}}},
      {"creep", false, {{"log_softening", How::uniform, 0.06, 0.3}}},
      {"arm_traction",
       false,
       {{"lateral_kpa", How::direction, 0.08, 0.25},
        {"head_kpa", How::direction, 0.08, 0.25},
        {"out", How::uniform, 0.75, 1.05, true},
        {"azimuth_rad", How::uniform, 0.5, 1.1, true},
        {"radius", How::uniform, 0.4, 0.65, true}}},
      {"chest_wall_motion",
       false,
       {{"amplitude_mm", How::either_sign, 3, 8},
        {"centre_u", How::uniform, -0.2, 0.2, true},
        {"centre_v", How::uniform, -0.2, 0.2, true},
        {"radius", How::uniform, 0.85, 1.2, true}}},
      {"gravity_tilt", false, {{"roll_rad", How::direction, 0.08, 0.25}, {"pitch_rad", How::direction, 0.08, 0.25}}},
      {"misregistration",
       false,
       {{"shift_x_mm", How::spread, 0, 2.5},
        {"shift_y_mm", How::spread, 0, 2.5},
        {"shift_z_mm", How::spread, 0, 2.5},
        {"turn_x_rad", How::spread, 0, 0.035},
        {"turn_y_rad", How::spread, 0, 0.035},
        {"turn_z_rad", How::spread, 0, 0.035}}},
      {"segmentation_offset", false, {{"offset_mm", How::either_sign, 0.6, 1.5}}},
      // A pad of the coil presses on the hanging breast: a dent in the image that gravity does not explain.
      {"coil_contact",
       true,
       {{"pressure_kpa", How::log_uniform, 0.06, 0.2},
        {"out", How::uniform, 0.3, 0.75, true},
        {"azimuth_rad", How::uniform, 0, turn, true},
        {"radius", How::uniform, 0.3, 0.5, true}}},
      // A scar: a patch of skin and the tissue under it, several times stiffer.
      {"scar",
       true,
       {{"log_ratio", How::uniform, 1.5, 2.7},
        {"out", How::uniform, 0.25, 0.75, true},
        {"azimuth_rad", How::uniform, 0, turn, true},
        {"radius", How::uniform, 0.25, 0.4, true}}},
      // Skin that is thicker on one side than on the other.
      {"skin_gradient", true, {{"log_change", How::uniform, 0.5, 1.1}, {"azimuth_rad", How::uniform, 0, turn, true}}}};
  return all;
}

std::vector<std::string> names(bool outside) {
  std::vector<std::string> found;
  for (const Row& row : rows())
    if (row.outside == outside) found.push_back(row.name);
  return found;
}

const Row& row_of(const std::string& name) {
  for (const Row& row : rows())
    if (row.name == name) return row;
  throw InputError(fmt::format("there is no cause '{}'; --effect: {}, null; --outside: {}", name,
                               fmt::join(names(false), ", "), fmt::join(names(true), ", ")));
}

double drawn(const Draw& draw, Random& random) {
  switch (draw.how) {
    case How::uniform:
      return random.uniform(draw.lower, draw.upper);
    case How::log_uniform:
      return random.log_uniform(draw.lower, draw.upper);
    case How::either_sign:
      return random.sign() * random.uniform(draw.lower, draw.upper);
    default: {
      const double z = random.normal();
      return draw.upper * std::clamp(z, -2.0, 2.0);
    }
  }
}

}  // namespace

std::vector<std::string> catalogue_causes() { return names(false); }
std::vector<std::string> outside_causes() { return names(true); }

const std::vector<Draw>& draws_of(const std::string& name) { return row_of(name).draws; }

Cause draw_cause(const std::string& name, std::uint64_t seed) {
  const Row& row = row_of(name);
  Random random(seed, name);
  Cause cause{name, row.outside, {}, {}};
  for (std::size_t i = 0; i < row.draws.size(); ++i) {
    const Draw& draw = row.draws[i];
    auto& target = draw.of_place ? cause.place : cause.values;
    if (draw.how != How::direction) {
      target[draw.name] = drawn(draw, random);
      continue;
    }
    const double length = random.uniform(draw.lower, draw.upper), angle = random.uniform(0, turn);
    target[draw.name] = length * std::cos(angle);
    target[row.draws.at(++i).name] = length * std::sin(angle);
  }
  return cause;
}

}  // namespace supine::phantom
