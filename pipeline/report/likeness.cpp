// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/likeness.h"

#include <string>
#include <vector>

#include "pipeline/report/polydata.h"

namespace supine::pipeline {

using Json = nlohmann::ordered_json;

Json likeness_json(const std::filesystem::path& diagnosis_vtp) {
  if (!std::filesystem::exists(diagnosis_vtp)) return nullptr;
  const PolyData file = read_polydata(diagnosis_vtp);
  const std::string prefix = "shape_", end = "_mm";
  std::vector<std::string> effects;
  std::vector<Eigen::VectorXd> shapes;
  for (const auto& [name, values] : file.point_arrays) {
    if (!name.starts_with(prefix) || !name.ends_with(end) || !values.allFinite() || values.norm() == 0) continue;
    effects.push_back(name.substr(prefix.size(), name.size() - prefix.size() - end.size()));
    shapes.push_back(values.normalized());
  }
  Json rows = Json::array();
  for (const auto& one : shapes) {
    Json row = Json::array();
    for (const auto& other : shapes) row.push_back(one.dot(other));
    rows.push_back(row);
  }
  return {{"effects", effects}, {"cosine", rows}};
}

}  // namespace supine::pipeline
