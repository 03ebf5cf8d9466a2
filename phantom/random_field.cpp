// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/random_field.h"

#include <cmath>
#include <numbers>

#include "phantom/random.h"

namespace supine::phantom {
namespace {

constexpr int waves = 300;

}  // namespace

RandomField::RandomField(std::uint64_t seed, std::string_view stream, double sd, double length_mm)
    : scale_(sd * std::sqrt(2.0 / waves)), waves_(3, waves), phases_(waves) {
  Random random(seed, stream);
  for (int w = 0; w < waves; ++w) {
    for (int i = 0; i < 3; ++i) waves_(i, w) = random.normal() / length_mm;
    phases_[w] = random.uniform(0, 2 * std::numbers::pi);
  }
}

double RandomField::at(const Eigen::Vector3d& place) const {
  return scale_ * (waves_.transpose() * place + phases_).array().cos().sum();
}

Eigen::VectorXd RandomField::over(const Points& places) const {
  Eigen::VectorXd values(places.rows());
  for (Eigen::Index i = 0; i < places.rows(); ++i) values[i] = at(places.row(i).transpose());
  return values;
}

}  // namespace supine::phantom
