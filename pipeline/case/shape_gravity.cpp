// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/shape_gravity.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/error.h"

namespace supine::pipeline {

namespace {

/// The gravity that the sidecar of a shape says it was computed with; none where that is of another tool.
std::optional<Eigen::Vector3d> gravity_of_shape(const nlohmann::ordered_json& sidecar) {
  if (!sidecar.is_object() || !sidecar.contains("gravity")) return std::nullopt;
  const nlohmann::ordered_json& used = sidecar["gravity"];
  if (!used.is_array() || used.size() != 3) return std::nullopt;
  Eigen::Vector3d gravity;
  for (int k = 0; k < 3; ++k) {
    if (!used[k].is_number()) return std::nullopt;
    gravity[k] = used[k];
  }
  return gravity;
}

}  // namespace

bool is_of_other_gravity(const nlohmann::ordered_json& sidecar, const Pose& pose) {
  constexpr double rounded = 1e-6;
  const auto used = gravity_of_shape(sidecar);
  return used && (*used - pose.gravity).norm() > rounded;
}

void check_gravity(const std::filesystem::path& shape, const Pose& pose) {
  std::ifstream stream(std::filesystem::path(shape).replace_extension(".json"));
  const auto figures = nlohmann::ordered_json::parse(stream, nullptr, false);
  if (!is_of_other_gravity(figures, pose)) return;
  const Eigen::Vector3d then = *gravity_of_shape(figures), now = pose.gravity;
  throw InputError(fmt::format(
      "{}: was computed with gravity ({:g}, {:g}, {:g}), and case.toml gives [pose.{}] ({:g}, {:g}, {:g}): simulate "
      "again, or correct it there",
      shape.string(), then.x(), then.y(), then.z(), pose.name, now.x(), now.y(), now.z()));
}

}  // namespace supine::pipeline
