// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/step_table.h"

#include <fmt/format.h>

#include <cmath>

#include "common/suggestion.h"

namespace supine::segmentation {

std::vector<std::string> StepTable::masks(std::string_view key) const {
  return texts(key).value_or(std::vector<std::string>{});
}

float StepTable::grey(std::string_view key, float absent, const Bounds& bounds) const {
  return static_cast<float>(number(key, bounds).value_or(absent));
}

GreyRange StepTable::greys(bool required) const {
  GreyRange range;
  range.lower = grey("lower", range.lower);
  range.upper = grey("upper", range.upper);
  if (required && std::isinf(range.lower) && std::isinf(range.upper))
    fail("lower", "is missing; give lower, upper or both (greys)");
  if (range.lower > range.upper) fail("lower", fmt::format("must not be above upper = {}", range.upper));
  return range;
}

Eigen::Vector3d StepTable::place(std::string_view key) const {
  require(key);
  return vector(key)->cwiseProduct(to_lps_) + Eigen::Vector3d::Zero();  // -0 becomes 0
}

std::vector<Eigen::Vector3d> StepTable::places(std::string_view key) const {
  require(key);
  auto result = *vectors(key);
  for (Eigen::Vector3d& place : result) place = place.cwiseProduct(to_lps_).eval();
  return result;
}

std::optional<double> StepTable::coordinate(std::string_view key, int axis) const {
  const auto value = number(key);
  return value ? std::optional(*value * to_lps_[axis]) : std::nullopt;
}

Tissue StepTable::tissue(std::string_view key, const std::string& name) const {
  const auto tissue = tissue_from_name(name);
  if (!tissue)
    fail(key,
         fmt::format("\"{}\" is no tissue; {}", name, suggestion(name, {tissue_names.begin(), tissue_names.end()})));
  return *tissue;
}

}  // namespace supine::segmentation
