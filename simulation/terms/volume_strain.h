// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/terms/term.h"

namespace supine::simulation {

/// Cells that resist a change of their whole volume: energy V κ/2 g² with the volume strain g(Ĵ), so pressure κ g g'.
/// Near incompressibility κ is hundreds of times the shear modulus: g of a shape that is a little wrong makes a
/// pressure that is all wrong, and Newton's method creeps behind it. The remedy is the mixed form V (p g - p²/(2κ)), p
/// = κ q, q an unknown of its own that Newton's steps move along the tangent: q + (g - q) + g' ∂Ĵ/∂x·s (Simo, Taylor
/// and Pister 1985; condensed, it is the same system of equations with q in the place of g in ∂r/∂x).
class VolumeStrainTerm {
 public:
  virtual ~VolumeStrainTerm() = default;
  /// Whether κ is so large in any cell that Newton's method gains by following q: over 20 μ, ν of about 0.48. On softer
  /// volumes g is the better pressure (a breast hanging 116 mm deep at ν = 0.45: 60 steps with q, 39 without).
  virtual bool nearly_incompressible() const = 0;
  /// @param step    mm, dof 3 node + axis; empty: none
  /// @param strain  out: g of each cell; 0 where there is no such energy
  /// @param change  out: g' ∂Ĵ/∂x·step; only with a step
  virtual void volume_strain(const State& state, const Eigen::VectorXd& step, Eigen::VectorXd& strain,
                             Eigen::VectorXd& change) const = 0;
  /// Takes away from r at @p state what the pressure would not be with q in the place of g: -Σ V κ (g - q) g' ∂Ĵ/∂x.
  virtual void take_off_pressure_defect(const State& state, Eigen::VectorXd& residual) const = 0;
};

}  // namespace supine::simulation
