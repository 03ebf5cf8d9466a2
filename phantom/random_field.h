// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "common/arrays.h"

namespace supine::phantom {

/// A smooth random function of place: mean 0, covariance sd² exp(−|a − b|² / (2 length²)) over draws, nearly normal.
/// A sum of cosines whose waves are drawn from that kernel's spectrum (random Fourier features, Rahimi and Recht 2007).
class RandomField {
 public:
  /// @param stream     names what the field is of: each name has a field of its own
  /// @param sd         in the unit of the field
  /// @param length_mm  over which it is correlated
  RandomField(std::uint64_t seed, std::string_view stream, double sd, double length_mm);

  /// @param place  mm
  double at(const Eigen::Vector3d& place) const;
  /// The same at the rows of @p places.
  Eigen::VectorXd over(const Points& places) const;

 private:
  double scale_;
  Eigen::Matrix3Xd waves_;  // 1/mm, one per column
  Eigen::VectorXd phases_;
};

}  // namespace supine::phantom
