// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>

#include "simulation/elements/assembly.h"

namespace supine::simulation {

/// Applies a matrix or its approximate inverse: out = A in. @p out has the right size already.
using LinearMap = std::function<void(const Eigen::VectorXd& in, Eigen::VectorXd& out)>;

struct KrylovReport {
  int iterations = 0;
  double reduction = 1;             ///< |b - A x| / |b| at the end
  bool converged = false;           ///< reduction <= tolerance
  bool negative_curvature = false;  ///< conjugate gradients met a direction v with vᵀ A v <= 0
};

/// Preconditioned Krylov solvers for one size; the basis is allocated once and kept.
class Krylov {
 public:
  explicit Krylov(Eigen::Index size) : size_(size) {}

  /// Conjugate gradients (Hestenes and Stiefel 1952) for symmetric positive definite A and preconditioner, from x = 0.
  /// Where A is not positive definite they stop at the first direction that shows it, x still one of descent of
  /// ½ xᵀ A x - bᵀ x (Steihaug 1983).
  /// @param worth  gives up when the residual falls too slowly to come to this reduction in max_iterations
  KrylovReport conjugate_gradients(const LinearMap& matrix, const LinearMap& preconditioner, const Eigen::VectorXd& b,
                                   double tolerance, int max_iterations, Eigen::VectorXd& x,
                                   double worth = std::numeric_limits<double>::infinity());

  /// GMRES without restart (Saad and Schultz 1986), preconditioned from the right so that its residual is the true
  /// one, from x = 0.
  KrylovReport gmres(const LinearMap& matrix, const LinearMap& preconditioner, const Eigen::VectorXd& b,
                     double tolerance, int max_iterations, Eigen::VectorXd& x);

 private:
  Eigen::Index size_;
  Eigen::VectorXd r_, z_, p_, q_;
  Eigen::MatrixXd basis_;
};

}  // namespace supine::simulation
