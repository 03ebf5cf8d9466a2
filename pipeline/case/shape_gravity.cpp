// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/shape_gravity.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/error.h"

namespace supine::pipeline {

void check_gravity(const std::filesystem::path& shape, const Pose& pose) {
  std::ifstream stream(std::filesystem::path(shape).replace_extension(".json"));
  const auto figures = nlohmann::json::parse(stream, nullptr, false);
  if (!figures.is_object() || !figures.contains("gravity")) return;
  const nlohmann::json& used = figures["gravity"];
  if (!used.is_array() || used.size() != 3) return;
  Eigen::Vector3d then;
  for (int k = 0; k < 3; ++k) {
    if (!used[k].is_number()) return;
    then[k] = used[k];
  }
  constexpr double rounded = 1e-6;
  const Eigen::Vector3d& now = pose.gravity;
  if ((then - now).norm() <= rounded) return;
  throw InputError(fmt::format(
      "{}: was computed with gravity ({:g}, {:g}, {:g}), and case.toml gives [pose.{}] ({:g}, {:g}, {:g}): simulate "
      "again, or correct it there",
      shape.string(), then.x(), then.y(), then.z(), pose.name, now.x(), now.y(), now.z()));
}

}  // namespace supine::pipeline
