// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

namespace supine::simulation {

/// Slip at which friction has come to 1/√2 of its full size, mm: below it the regularised law creeps like a spring.
inline constexpr double friction_slip_mm = 0.5;
/// Pressure over which contact sets in, kPa; a few per cent of what the breast's weight makes.
inline constexpr double friction_pressure_kpa = 0.02;

/// Pressure that friction acts on, from the normal spring's push @p z in kPa: 0 under tension, z less half of
/// friction_pressure_kpa once in full contact, a parabola between; C1.
template <class T>
T contact_pressure(const T& z) {
  if (!(z > 0.0)) return T(0.0);
  if (z < friction_pressure_kpa) return z * z / (2 * friction_pressure_kpa);
  return z - 0.5 * friction_pressure_kpa;
}

inline double contact_pressure_slope(double z) {
  if (!(z > 0)) return 0;
  return z < friction_pressure_kpa ? z / friction_pressure_kpa : 1;
}

/// s/√(|s|² + s0²): the direction of friction, as far as it is mobilised.
inline Eigen::Vector3d mobilised(const Eigen::Vector3d& slip) {
  return slip / std::sqrt(slip.squaredNorm() + friction_slip_mm * friction_slip_mm);
}

/// Its derivative with respect to the slip.
inline Eigen::Matrix3d mobilised_slope(const Eigen::Vector3d& slip) {
  const double length = std::sqrt(slip.squaredNorm() + friction_slip_mm * friction_slip_mm);
  const Eigen::Vector3d direction = slip / length;
  return (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / length;
}

/// Where one point of the inner surface is, relative to the muscle.
struct ContactPlace {
  Eigen::Vector3d gradient;  ///< ∇φ at x
  Eigen::Vector3d slip;      ///< T (x - X), mm
  double approach_mm = 0;    ///< φ(x) - φ(X)
};

/// What acts there.
template <class T>
struct ContactMaterial {
  T normal;      ///< kPa/mm
  T tangential;  ///< kPa/mm
  T friction;    ///< Coulomb's coefficient
  T offset_mm;   ///< of the muscle, at this load
};

/// Force on the breast's side of the residual (minus the traction), kPa:
/// k_n (φ(x) - φ(X) - offset) ∇φ(x) + (k_t + μ p/√(|s|² + s0²)) s.
template <class T>
Eigen::Matrix<T, 3, 1> contact_force(const ContactPlace& place, const ContactMaterial<T>& material) {
  const T push = material.normal * (place.approach_mm - material.offset_mm);
  Eigen::Matrix<T, 3, 1> force = push * place.gradient.cast<T>() + material.tangential * place.slip.cast<T>();
  if constexpr (std::is_same_v<T, double>)  // a derivative may be wanted where there is no friction
    if (material.friction == 0) return force;
  return force + (material.friction * contact_pressure(T(-push))) * mobilised(place.slip).cast<T>();
}

}  // namespace supine::simulation
