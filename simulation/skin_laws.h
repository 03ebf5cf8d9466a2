// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "simulation/model.h"

namespace supine::simulation {

/// What does not vary over the skin.
struct SkinSettings {
  SkinLaw law = SkinLaw::neo_hookean;
  Compression compression = Compression::tension_field;
};

/// The skin of one face.
template <class T>
struct SkinMaterial {
  T modulus;            ///< Young's modulus × thickness, kPa mm
  T poisson;            ///< corotational only
  T compression_share;  ///< share of the full energy that stays where the membrane would wrinkle
  T prestretch;         ///< stretch already there in the undeformed shape
};

/// Value part of a number that may carry derivatives.
inline double value_of(double x) { return x; }
template <class J>
double value_of(const J& x) {
  return x.a;
}

/// Invariants of the in-plane Cauchy-Green tensor: a = λ1² + λ2², b = λ1² λ2².
template <class T>
struct PlaneInvariants {
  T a, b;
};

/// Energy per undeformed volume over E, and its derivatives with respect to a and b (dimensionless).
template <class T>
struct SkinEnergy {
  T psi, psi_a, psi_b;
};

/// Full membrane energy. neo_hookean: 1/6 (a + 1/b - 3) (incompressible, μ = E/3).
/// corotational: plane stress 1/(2(1-ν²)) [(λ1-1)² + (λ2-1)² + 2ν(λ1-1)(λ2-1)], with λ1+λ2 = √(a+2√b).
template <class T, class S>
SkinEnergy<T> full_skin_energy(SkinLaw law, const S& nu, const PlaneInvariants<T>& c) {
  using std::sqrt;
  if (law == SkinLaw::neo_hookean) {
    const T inverse = 1.0 / c.b;
    return {(c.a + inverse - 3.0) / 6.0, T(1.0 / 6), -inverse * inverse / 6.0};
  }
  const T product = sqrt(c.b), sum = sqrt(c.a + 2.0 * product);
  const S scale = 0.5 / (1.0 - nu * nu);
  const T product_b = 0.5 / product;
  return {scale * (c.a - 2.0 * sum + 2.0 + 2.0 * nu * (product - sum + 1.0)), scale * (1.0 - (1.0 + nu) / sum),
          scale * 2.0 * product_b * (nu - (1.0 + nu) / sum)};
}

/// Relaxed energy of a membrane that cannot be compressed (Pipkin 1986, Steigmann 1990): the full one where taut,
/// the uniaxial one where the second stretch is under its natural width, zero where slack. C1 across the borders.
template <class T, class S>
SkinEnergy<T> relaxed_skin_energy(SkinLaw law, const S& nu, const PlaneInvariants<T>& c) {
  using std::sqrt;
  const double a = value_of(c.a), b = value_of(c.b);
  const double spread = std::sqrt(std::max(0.25 * a * a - b, 0.0));
  const double first = 0.5 * a + spread, second = std::max(0.5 * a - spread, 0.0);  // squared principal stretches
  // Within rounding of the border the membrane counts as taut: both energies agree there and the taut one is smooth.
  constexpr double slack = 1e-12;
  const bool taut = law == SkinLaw::neo_hookean
                        ? second * std::sqrt(first) >= 1 - slack
                        : std::sqrt(second) - 1 >= -value_of(nu) * (std::sqrt(first) - 1) - slack;
  if (taut && first >= 1 - slack) return full_skin_energy(law, nu, c);
  if (first <= 1) return {T(0.0), T(0.0), T(0.0)};
  const T root = sqrt(0.25 * c.a * c.a - c.b);
  const T stretch2 = 0.5 * c.a + root, stretch = sqrt(stretch2);
  const T first_a = 0.5 + 0.25 * c.a / root, first_b = -0.5 / root;
  if (law == SkinLaw::neo_hookean) {
    const T slope = (1.0 - 1.0 / (stretch2 * stretch)) / 6.0;
    return {(stretch2 + 2.0 / stretch - 3.0) / 6.0, slope * first_a, slope * first_b};
  }
  const T slope = 0.5 * (stretch - 1.0) / stretch;
  return {0.5 * (stretch - 1.0) * (stretch - 1.0), slope * first_a, slope * first_b};
}

template <class T, class S>
SkinEnergy<T> skin_energy(const SkinSettings& s, const SkinMaterial<S>& m, const PlaneInvariants<T>& c) {
  const SkinEnergy<T> full = full_skin_energy(s.law, m.poisson, c);
  if (s.compression == Compression::full) return full;
  const SkinEnergy<T> relaxed = relaxed_skin_energy(s.law, m.poisson, c);
  const S& w = m.compression_share;
  return {(1.0 - w) * relaxed.psi + w * full.psi, (1.0 - w) * relaxed.psi_a + w * full.psi_a,
          (1.0 - w) * relaxed.psi_b + w * full.psi_b};
}

}  // namespace supine::simulation
