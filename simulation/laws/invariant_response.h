// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "simulation/laws/material.h"

namespace supine::simulation {

// Laws whose energy density is W(I1, I2, L) with I1 = tr C, I2 = (I1² - tr C²)/2, C = FᵀF and L = ln det F. A law is a
// file of its own, a struct with what InvariantLaw has and a response(); stress, tangent, ∂/∂X and element matrices
// follow from there.

/// W and its derivatives, kPa. I2 enters linearly with a constant factor.
template <class T>
struct InvariantResponse {
  T energy{0.0}, w1{0.0}, w2{0.0}, wl{0.0};  ///< W, ∂W/∂I1, ∂W/∂I2, ∂W/∂L
  T w11{0.0}, w1l{0.0}, wll{0.0};            ///< second derivatives
};

/// Strain of one material point. @pre det F > 0
struct InvariantStrain {
  Matrix3 f;  ///< F
  Matrix3 g;  ///< F^{-T} = ∂L/∂F
  double i1, i2, log_j, j;

  InvariantStrain(const Matrix3& deformation, double det) : f(deformation), j(det) {
    // Cofactors: F^{-T} has the cross products of F's columns as columns, over det F.
    g.col(0) = f.col(1).cross(f.col(2)) / det;
    g.col(1) = f.col(2).cross(f.col(0)) / det;
    g.col(2) = f.col(0).cross(f.col(1)) / det;
    i1 = f.squaredNorm();
    i2 = det * det * g.squaredNorm();
    log_j = std::log(det);
  }
  explicit InvariantStrain(const Matrix3& deformation) : InvariantStrain(deformation, deformation.determinant()) {}
};

/// K = I1 - 3 - 2L: I1 - 3 where the volume keeps; it is >= 0, zero at rest only, and of second order in the strain as
/// 2 ε:ε, so that laws of K have the same μ and λ at small strain whatever their further numbers.
inline double distortion(const InvariantStrain& s) { return s.i1 - 3 - 2 * s.log_j; }

/// Derivatives with respect to K: chain rule of K = I1 - 3 - 2L.
template <class T>
void add_distortion_energy(const T& energy, const T& first, const T& second, InvariantResponse<T>& w) {
  w.energy += energy;
  w.w1 += first;
  w.wl -= 2.0 * first;
  w.w11 += second;
  w.w1l -= 2.0 * second;
  w.wll += 4.0 * second;
}

/// Adds λ/2 L².
template <class T>
void add_log_volume_energy(const T& lambda, double log_j, InvariantResponse<T>& w) {
  w.energy += 0.5 * log_j * log_j * lambda;
  w.wl += lambda * log_j;
  w.wll += lambda;
}

/// Strain g(Ĵ) of the volume ratio Ĵ of a whole cell, g' and g''. Its energy is g²/2 per unit of modulus and volume
/// (terms/bulk.h). @pre Ĵ > 0
struct VolumeStrain {
  double value, first, second;
};

/// What most laws have in common; a law says otherwise where it has to.
struct InvariantLaw {
  /// How far the state is from a law's limit, 1 at rest; <= 0 where the law has no energy.
  static double margin(const InvariantStrain&, const BulkMaterial<double>&) { return 1; }
  /// ln Ĵ.
  static VolumeStrain volume_strain(double ratio) { return {std::log(ratio), 1 / ratio, -1 / (ratio * ratio)}; }
};

/// P = ∂W/∂F = 2 W1 F + W_L F^{-T} + 2 W2 (I1 F - F C).
template <class T>
Eigen::Matrix<T, 3, 3> stress_of(const InvariantStrain& s, const InvariantResponse<T>& w) {
  const Matrix3 second = 2 * (s.i1 * s.f - s.f * (s.f.transpose() * s.f));
  Eigen::Matrix<T, 3, 3> p;
  for (int i = 0; i < 9; ++i) p.data()[i] = 2.0 * s.f.data()[i] * w.w1 + s.g.data()[i] * w.wl + second.data()[i] * w.w2;
  return p;
}

}  // namespace supine::simulation
