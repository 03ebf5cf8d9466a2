// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/tissue_range.h"

namespace supine::calibration {

std::optional<TissueRange> tissue_range(const std::string& parameter) {
  if (parameter == "breast.young_modulus_kpa") return TissueRange{0.2, 20};
  if (parameter == "skin.young_modulus_kpa") return TissueRange{5, 480};
  return {};
}

std::vector<Eigen::Index> outside_tissue(const FreeParameters& parameters, const Eigen::VectorXd& u) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const auto range = tissue_range(parameters.names()[static_cast<std::size_t>(i)]);
    const double value = parameters.value(i, u[i]);
    if (range && (value < range->softest_kpa || value > range->stiffest_kpa)) rows.push_back(i);
  }
  return rows;
}

}  // namespace supine::calibration
