// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <type_traits>

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
  T stiffening = T(0);  ///< b of the exponential law, >= 0; neo_hookean only
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
/// Neither stiffens: see stiffened().
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

/// A neo-Hookean energy ψ = w/6 made to stiffen (the two-dimensional form of Fung's and Demiray's exponential): w
/// becomes (e^{βw} - 1)/β, β >= 0, unchanged at β = 0. The relaxed energy stays the lowest over the widths, because the
/// new one grows with the old: the same formula serves both, and both stay C1 across the borders.
template <class T, class S>
SkinEnergy<T> stiffened(const SkinEnergy<T>& e, const S& beta) {
  using std::exp;
  const T w = 6.0 * e.psi, argument = beta * w;
  const T growth = exp(argument);
  // (e^z - 1)/z by its series where the quotient would lose digits; at β = 0 it is 1 with the right slope in β.
  const T mean = std::abs(value_of(argument)) < 1e-3
                     ? T(1.0 + argument * (0.5 + argument * (1.0 / 6 + argument * (1.0 / 24 + argument / 120.0))))
                     : T((growth - 1.0) / argument);
  return {e.psi * mean, growth * e.psi_a, growth * e.psi_b};
}

/// What the skin carries. tension_field: relaxed + share × (full - relaxed); only the relaxed part stiffens, so that
/// the share stays a weak spring in wrinkles however compressed they are. full: the full energy, stiffened.
template <class T, class S>
SkinEnergy<T> skin_energy(const SkinSettings& s, const SkinMaterial<S>& m, const PlaneInvariants<T>& c) {
  const bool stiffens = s.law == SkinLaw::neo_hookean && (!std::is_same_v<S, double> || value_of(m.stiffening) > 0);
  const SkinEnergy<T> full = full_skin_energy(s.law, m.poisson, c);
  if (s.compression == Compression::full) return stiffens ? stiffened(full, m.stiffening) : full;
  const SkinEnergy<T> relaxed = relaxed_skin_energy(s.law, m.poisson, c);
  const S& w = m.compression_share;
  if (!stiffens)
    return {(1.0 - w) * relaxed.psi + w * full.psi, (1.0 - w) * relaxed.psi_a + w * full.psi_a,
            (1.0 - w) * relaxed.psi_b + w * full.psi_b};
  const SkinEnergy<T> stiff = stiffened(relaxed, m.stiffening);
  return {stiff.psi + w * (full.psi - relaxed.psi), stiff.psi_a + w * (full.psi_a - relaxed.psi_a),
          stiff.psi_b + w * (full.psi_b - relaxed.psi_b)};
}

}  // namespace supine::simulation
