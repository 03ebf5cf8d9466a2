// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/nuisance_words.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace supine::diagnosis {
namespace {

/// {pose} is the pose's name.
const std::map<std::string, std::string>& table() {
  static const std::map<std::string, std::string> words = {
      {"misregistration.shift_x_mm", "where the {pose} scan lies, along x"},
      {"misregistration.shift_y_mm", "where the {pose} scan lies, along y"},
      {"misregistration.shift_z_mm", "where the {pose} scan lies, along z"},
      {"misregistration.turn_x_rad", "how the {pose} scan is turned about x"},
      {"misregistration.turn_y_rad", "how the {pose} scan is turned about y"},
      {"misregistration.turn_z_rad", "how the {pose} scan is turned about z"},
      {"gravity_tilt.roll_rad", "which way is down in {pose}, left to right"},
      {"gravity_tilt.pitch_rad", "which way is down in {pose}, head to feet"},
      {"chest_wall_motion.amplitude_mm", "how far breath has moved the chest in {pose}"},
      {"segmentation_offset.offset_mm", "where the imaged skin really lies"},
      {"incompressibility.log_factor", "how much the tissue can be compressed"},
      {"gland_stiffness.log_ratio", "how stiff the gland is over fat"},
      {"interface.normal_kpa_per_mm", "how firmly muscle holds the breast"},
      {"adhesion.log_factor", "how firmly muscle holds the breast along its face"},
      {"cut.stiffness_kpa_per_mm", "how firmly the cut's edge is held"},
  };
  return words;
}

/// "breast.young_modulus_kpa": "breast young modulus".
std::string spoken(std::string name) {
  for (const std::string unit : {"_kpa_per_mm", "_kpa", "_mm", "_rad", "_kg_m3"})
    if (name.ends_with(unit)) {
      name.resize(name.size() - unit.size());
      break;
    }
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '_' || c == '.'; }, ' ');
  return name;
}

/// By how much it is off: a factor, an angle or a length.
std::string amount(const Nuisance& nuisance) {
  const double change = nuisance.value * nuisance.sigma;
  if (nuisance.parameter.ends_with("_rad")) return fmt::format("{:+.1f}°", change * 180 / std::numbers::pi);
  if (nuisance.parameter.ends_with("_mm") && !nuisance.effect.empty()) return fmt::format("{:+.1f} mm", change);
  return fmt::format("x {:.2g}", std::exp(change));
}

}  // namespace

std::string words_of(const std::string& name) {
  const std::size_t slash = name.find('/');
  const std::string pose = slash == std::string::npos ? "" : name.substr(0, slash);
  const std::string what = slash == std::string::npos ? name : name.substr(slash + 1);
  const auto known = table().find(what);
  if (known == table().end()) return spoken(what) + (pose.empty() ? "" : " in " + pose);
  std::string words = known->second;
  if (const std::size_t place = words.find("{pose}"); place != std::string::npos) words.replace(place, 6, pose);
  return words;
}

std::vector<FarNuisance> far_nuisances(const std::vector<Nuisance>& nuisances) {
  constexpr double far = 1.5;
  std::vector<FarNuisance> list;
  for (const Nuisance& nuisance : nuisances)
    if (std::abs(nuisance.value) >= far && nuisance.source != "registration")
      list.push_back(
          {nuisance.name(),
           fmt::format("{}: {} ({:.1f} sigma)", words_of(nuisance.name()), amount(nuisance), std::abs(nuisance.value)),
           nuisance.value});
  std::stable_sort(list.begin(), list.end(),
                   [](const FarNuisance& a, const FarNuisance& b) { return std::abs(a.sigma) > std::abs(b.sigma); });
  return list;
}

std::string too_far_words(const std::vector<Nuisance>& nuisances) {
  constexpr double too_far = 4;
  const auto furthest = std::max_element(nuisances.begin(), nuisances.end(), [](const auto& a, const auto& b) {
    return std::abs(a.value) < std::abs(b.value);
  });
  if (furthest == nuisances.end() || std::abs(furthest->value) < too_far) return "";
  return fmt::format("{} ended {:.1f} sigma from where it is expected", words_of(furthest->name()),
                     std::abs(furthest->value));
}

}  // namespace supine::diagnosis
