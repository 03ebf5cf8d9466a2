// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simulation/solve/chain.h"

namespace supine::simulation {

/// What one parameter moves, per unit of it.
struct ChainDerivative {
  Points prone;  ///< of the known shape, #N by 3, mm per unit; zero unless the parameter moves the imaged skin
  Points X;      ///< of the undeformed shape, the same
  std::vector<Points> poses;  ///< of every pose, the same, in the order of ChainSolution::poses
};

/// Exact derivatives of a solved chain with respect to any parameter of the base model or the catalogue, whether its
/// effect is in the model or not (then at its null), through both solves:
///   L_p dX/dp = -(∂r_p/∂p + K_p dx_p/dp),   K_s dx_s/dp = -(∂r_s/∂p + L_s dX/dp),
/// L = ∂r/∂X, K = ∂r/∂x, p prone, s another pose. One factorisation per pose when made, one back-substitution per pose
/// and parameter after that; many at a time cost a fraction of what they cost one by one.
class Sensitivities {
 public:
  /// @param chain  must outlive the object, which borrows analysed solvers of it and sets its fields
  /// @param solution  of @p model by @p chain, with every pose; copied
  /// @throws NumericalFailure  a shape at which the tangent is singular
  Sensitivities(Chain& chain, const Model& model, const ChainSolution& solution);
  ~Sensitivities();

  /// @param parameter  as in parameters.h, for example "ligament.stiffness_kpa_per_mm"
  /// @throws InputError  no such parameter
  ChainDerivative of(const std::string& parameter) const;
  std::vector<ChainDerivative> of(const std::vector<std::string>& parameters) const;

  /// How the fields of one pose change along a direction: sets their derivatives (Dual::v), which come as zeros.
  using FieldDirection = std::function<void(const PoseLoad& pose, Fields<Dual>& fields)>;
  /// The same as of(), along any change of the fields.
  ChainDerivative along(const FieldDirection& direction) const;
  std::vector<ChainDerivative> along(const std::vector<FieldDirection>& directions) const;

  /// What forces on the nodes move in one pose, the undeformed shape held: K_s dx_s = force.
  /// @param pose   in the order of ChainSolution::poses
  /// @param force  3 per node, mN
  /// @return #N by 3, mm
  Points moved_by(std::size_t pose, const Eigen::VectorXd& force) const;
  std::vector<Points> moved_by(std::size_t pose, const std::vector<Eigen::VectorXd>& forces) const;

  /// Gradient of a scalar J(x of every pose) by the adjoint method: two back-substitutions in all, whatever the number
  /// of parameters.
  /// @param by_pose  ∂J/∂x of each pose, #N by 3, in the order of ChainSolution::poses, per mm
  /// @return dJ/dp, one per parameter, per unit of it
  /// @throws InputError  no such parameter
  Eigen::VectorXd gradient(const std::vector<Points>& by_pose, const std::vector<std::string>& parameters) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace supine::simulation
