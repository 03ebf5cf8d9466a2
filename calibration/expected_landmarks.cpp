// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/expected_landmarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/statistics.h"

namespace supine::calibration {

LandmarkAgreement compare_to_expected(const Landmarks& measured, const ExpectedPlaces& expected) {
  LandmarkAgreement result;
  result.names = measured.names;
  const auto count = static_cast<Eigen::Index>(measured.names.size());
  Eigen::VectorXd off(3 * count);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::string& name = measured.names[static_cast<std::size_t>(i)];
    const auto found = std::find(expected.names.begin(), expected.names.end(), name);
    if (found == expected.names.end())
      throw InputError(fmt::format("landmark '{}' was measured, but nothing is expected of it ({})", name,
                                   fmt::join(expected.names, ", ")));
    const Eigen::Index row = found - expected.names.begin();
    off.segment<3>(3 * i) = (measured.points.row(i) - expected.places.row(row)).transpose();
    for (int axis = 0; axis < 3; ++axis) rows.push_back(3 * row + axis);
  }
  const Eigen::MatrixXd covariance = expected.covariance(rows, rows);
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success)
    throw InputError("the covariance of the expected landmarks is not positive; write the file again");
  result.off_mm.resize(count), result.expected_mm.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    result.off_mm[i] = off.segment<3>(3 * i).norm();
    result.expected_mm[i] = std::sqrt(covariance.diagonal().segment<3>(3 * i).sum());
  }
  result.chi_squared = off.dot(factor.solve(off));
  result.degrees = static_cast<int>(3 * count);
  result.p_value = chi_squared_above(result.degrees, result.chi_squared);
  return result;
}

}  // namespace supine::calibration
