// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <vector>

#include "simulation/elements/assembly.h"

namespace supine::simulation {

/// Applies a matrix or its approximate inverse: out = A in. @p out has the right size already; it is not @p in.
using LinearMap = std::function<void(const Eigen::VectorXd& in, Eigen::VectorXd& out)>;

struct KrylovReport {
  int iterations = 0;
  double reduction = 1;             ///< |b - A x| / |b| at the end
  bool converged = false;           ///< reduction <= tolerance
  bool negative_curvature = false;  ///< conjugate gradients met a direction v with vᵀ A v <= 0
};

struct KrylovOptions {
  double tolerance = 1e-6;   ///< of the reduction, > 0
  int max_iterations = 100;  ///< > 0
  /// Conjugate gradients give up where the residual falls too slowly to come to this reduction in max_iterations.
  double worthwhile_reduction = std::numeric_limits<double>::infinity();
};

/// Preconditioned Krylov solvers for A x = b of one size; the basis is allocated once and kept.
class Krylov {
 public:
  /// @param size  of b and x
  explicit Krylov(Eigen::Index size) : size_(size) {}

  /// Conjugate gradients (Hestenes and Stiefel 1952) for symmetric positive definite A and preconditioner, from x = 0.
  /// Where A is not positive definite they stop at the first direction that shows it, x still one of descent of
  /// ½ xᵀ A x - bᵀ x (Steihaug 1983).
  /// @param preconditioner  approximate A⁻¹
  /// @param x  out: what was reached, whether converged or not; zero for b = 0
  /// @param way  out: where negative curvature was met, the direction that shows it, one of descent too; else as it was
  KrylovReport conjugate_gradients(const LinearMap& matrix, const LinearMap& preconditioner, const Eigen::VectorXd& b,
                                   const KrylovOptions& options, Eigen::VectorXd& x, Eigen::VectorXd* way = nullptr);

  /// Flexible GMRES without restart (Saad 1993), preconditioned from the right so that its residual is the true one, in
  /// single precision too; from x = 0; any regular A. Parameters as of conjugate_gradients(); the bases take
  /// max_iterations + 1 and as many vectors of memory as there were iterations.
  KrylovReport gmres(const LinearMap& matrix, const LinearMap& preconditioner, const Eigen::VectorXd& b,
                     const KrylovOptions& options, Eigen::VectorXd& x);

 private:
  Eigen::Index size_;
  Eigen::VectorXd r_, z_, p_, q_;                // residual, preconditioned residual, direction, A times direction
  Eigen::MatrixXd basis_;                        // of GMRES, one vector per column
  std::vector<Eigen::VectorXd> preconditioned_;  // what the preconditioner made of each
};

}  // namespace supine::simulation
