// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "simulation/laws/material.h"
#include "simulation/model.h"

namespace supine::simulation {

// Laws whose energy density is W(I1, I2, L) with I1 = tr C, I2 = (I1² - tr C²)/2, C = FᵀF and L = ln det F. A law is
// its case in invariant_response(); stress, tangent, ∂/∂X and element matrices follow from there.
//
//   neo_hookean           μ/2 (I1 - 3 - 2L) + λ/2 L²                                 (Bonet and Wood 2008, eq. 6.27);
//                         with stiffening b, I1 - 3 becomes (e^{b (I1 - 3)} - 1)/b     (Fung 1967; Demiray 1972)
//   mooney_rivlin         C10 (I1 - 3) + C01 (I2 - 3) - 2 (C10 + 2 C01) L + (λ - 4 C01)/2 L²
//                         (FEBio theory manual, coupled Mooney-Rivlin); C01 = share μ/2, C10 = (1 - share) μ/2
//   yeoh                  C1 K + C2 K² + C3 K³ + λ/2 L², K = I1 - 3 - 2L, C1 = μ/2   (Yeoh 1993, with K for I1 - 3)
//   gent                  -μ/2 Jm ln(1 - K/Jm) + λ/2 L²                               (Gent 1996, with K for I1 - 3)
//   neo_hookean_calculix  μ/2 (J^{-2/3} I1 - 3) + κ/2 (J - 1)², κ = λ + 2μ/3          (CalculiX *HYPERELASTIC, NEO
//   HOOKE
//                         with C10 = μ/2, D1 = 2/κ)
//
// K is I1 - 3 where the volume keeps; it is >= 0, zero at rest only, and of second order in the strain as 2 ε:ε, so
// that yeoh and gent have the same μ and λ at small strain whatever their further numbers. Mooney-Rivlin's I2 brings
// 4 C01 of its own to λ, which is taken off L².

/// The laws of this file; the others have a rotation (rotation_laws.h).
constexpr bool is_invariant_law(BulkLaw law) { return law != BulkLaw::corotational && law != BulkLaw::corotational_qr; }

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

/// K of the header comment.
inline double distortion(const InvariantStrain& s) { return s.i1 - 3 - 2 * s.log_j; }

/// How far the state is from a law's limit, 1 at rest; <= 0 where the law has no energy: gent beyond its pole.
inline double law_margin(BulkLaw law, const InvariantStrain& s, const BulkMaterial<double>& m) {
  return law == BulkLaw::gent ? 1 - distortion(s) / m.shape[0] : 1;
}

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

template <class T>
void add_neo_hookean(const InvariantStrain& s, const BulkMaterial<T>& m, InvariantResponse<T>& w) {
  using std::exp, std::expm1;
  const T half = 0.5 * m.mu_kpa;
  const double excess = s.i1 - 3;
  w.wl -= m.mu_kpa;
  if (m.stiffening == T(0.0)) {
    w.energy += half * (excess - 2 * s.log_j);
    // ∂/∂b at b = 0 of (e^{bx} - 1)/b and of its derivative e^{bx}: x²/2 and x, carried by b itself when T has a slope.
    w.energy += half * m.stiffening * (0.5 * excess * excess);
    w.w1 += half * (1.0 + m.stiffening * excess);
    return;
  }
  const T growth = exp(m.stiffening * excess);
  w.energy += half * (expm1(m.stiffening * excess) / m.stiffening - 2 * s.log_j);
  w.w1 += half * growth;
  w.w11 += half * m.stiffening * growth;
}

template <class T>
void add_calculix_neo_hookean(const InvariantStrain& s, const BulkMaterial<T>& m, InvariantResponse<T>& w) {
  const double share = std::exp(-2.0 / 3 * s.log_j), bar = share * s.i1;  // J^{-2/3}, Ī1
  const T half = 0.5 * m.mu_kpa, bulk = m.lambda_kpa + (2.0 / 3) * m.mu_kpa;
  w.energy += half * (bar - 3) + 0.5 * (s.j - 1) * (s.j - 1) * bulk;
  w.w1 += half * share;
  w.w1l += half * (-2.0 / 3 * share);
  w.wl += half * (-2.0 / 3 * bar) + bulk * (s.j * (s.j - 1));
  w.wll += half * (4.0 / 9 * bar) + bulk * (s.j * (2 * s.j - 1));
}

/// @pre law_margin() > 0
template <class T>
InvariantResponse<T> invariant_response(BulkLaw law, const InvariantStrain& s, const BulkMaterial<T>& m) {
  using std::log;
  InvariantResponse<T> w;
  const T half = 0.5 * m.mu_kpa;
  const double k = distortion(s);
  switch (law) {
    case BulkLaw::neo_hookean:
      add_neo_hookean(s, m, w);
      add_log_volume_energy(m.lambda_kpa, s.log_j, w);
      break;
    case BulkLaw::mooney_rivlin: {
      const T c01 = half * m.shape[0];
      add_distortion_energy(T((half - c01) * k), T(half - c01), T(0.0), w);
      w.energy += c01 * (s.i2 - 3 - 4 * s.log_j);
      w.w2 += c01;
      w.wl -= 4.0 * c01;
      add_log_volume_energy(T(m.lambda_kpa - 4.0 * c01), s.log_j, w);
      break;
    }
    case BulkLaw::yeoh: {
      const T &r2 = m.shape[0], &r3 = m.shape[1];
      add_distortion_energy(T(half * k * (1.0 + k * (r2 + k * r3))), T(half * (1.0 + k * (2.0 * r2 + 3.0 * k * r3))),
                            T(half * (2.0 * r2 + 6.0 * k * r3)), w);
      add_log_volume_energy(m.lambda_kpa, s.log_j, w);
      break;
    }
    case BulkLaw::gent: {
      const T& limit = m.shape[0];
      const T room = 1.0 - k / limit;
      add_distortion_energy(T(-half * limit * log(room)), T(half / room), T(half / (limit * room * room)), w);
      add_log_volume_energy(m.lambda_kpa, s.log_j, w);
      break;
    }
    case BulkLaw::neo_hookean_calculix:
      add_calculix_neo_hookean(s, m, w);
      break;
    case BulkLaw::corotational:
    case BulkLaw::corotational_qr:
      break;
  }
  return w;
}

/// Energy of the volume ratio Ĵ of a whole cell, per unit of its modulus, and its derivatives: ln²Ĵ/2, (Ĵ - 1)²/2 for
/// neo_hookean_calculix (bulk.h). @pre Ĵ > 0
struct VolumeEnergy {
  double energy, first, second;
};
inline VolumeEnergy volume_energy(BulkLaw law, double ratio) {
  if (law == BulkLaw::neo_hookean_calculix) return {0.5 * (ratio - 1) * (ratio - 1), ratio - 1, 1};
  const double log_ratio = std::log(ratio);
  return {0.5 * log_ratio * log_ratio, log_ratio / ratio, (1 - log_ratio) / (ratio * ratio)};
}

/// P = ∂W/∂F = 2 W1 F + W_L F^{-T} + 2 W2 (I1 F - F C).
template <class T>
Eigen::Matrix<T, 3, 3> stress_of(const InvariantStrain& s, const InvariantResponse<T>& w) {
  const Matrix3 second = 2 * (s.i1 * s.f - s.f * (s.f.transpose() * s.f));
  Eigen::Matrix<T, 3, 3> p;
  for (int i = 0; i < 9; ++i) p.data()[i] = 2.0 * s.f.data()[i] * w.w1 + s.g.data()[i] * w.wl + second.data()[i] * w.w2;
  return p;
}

}  // namespace supine::simulation
