// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/elements/assembly.h"
#include "simulation/fields.h"

namespace supine::simulation {

/// Where the forces are evaluated.
struct State {
  const Points& x;  ///< deformed nodes, #N by 3, mm
  const Points& X;  ///< undeformed nodes, #N by 3, mm
  double load = 1;  ///< factor on gravity, tractions and the muscle's motion, 0 to 1
  /// #cells: volume strain q that the pressure inside ∂r/∂x has (terms/volume_strain.h); nullptr: that of x and X.
  const Eigen::VectorXd* volume_strain = nullptr;
};

/// A piece of mechanics. Its contribution to the residual r is the derivative with respect to x of its energy
/// (internal energy positive, potential of loads negative), so that equilibrium is r = 0.
class Term {
 public:
  virtual ~Term() = default;
  /// Takes over material and loads; cheap, called whenever a parameter or the pose changes.
  virtual void set_fields(const Fields<double>& fields) = 0;
  /// Adds energy, r, ∂r/∂x and ∂r/∂X as demanded.
  virtual void add(const State& state, const Demand& demand, Sums& sums) const = 0;
  /// Adds ∂r/∂p at frozen x and X, where @p fields carries the derivative of every field with respect to p and its
  /// values are those of the last set_fields().
  virtual void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const = 0;
  /// Whether add() fills in an energy with the fields as set (corotational_qr and friction have none).
  virtual bool has_energy() const { return true; }
};

}  // namespace supine::simulation
