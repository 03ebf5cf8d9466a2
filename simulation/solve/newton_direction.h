// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

#include "simulation/mechanics.h"
#include "simulation/solve/krylov.h"
#include "simulation/solve/spd_solver.h"

namespace supine::simulation {

/// Newton steps for one Mechanics: solves ∂r/∂x s = -r or ∂r/∂X s = -r.
///
/// One factor of ∂r/∂x (or, on large meshes, one multigrid hierarchy) is kept and used as preconditioner for as long as
/// Krylov iterations with it are cheaper than a new one. On quadratic cells a cycle of p-multigrid stands in its place,
/// made anew for every tangent; where cells are nearly incompressible, or it does not come to a solution, the factor.
/// Where ∂r/∂x is not positive definite, the one without negative curvature (Demand::convex) is factorised, and
/// conjugate gradients with it on ∂r/∂x itself find the step, up to where they meet a direction of negative curvature
/// and some millimetres along that: the changed tangent alone is too stiff and creeps. -∂r/∂X is close to ∂r/∂x F
/// (moving a point of the body together with its place leaves what is balanced balanced), so the same factor serves the
/// inverse solve, whose matrix is not symmetric and would cost three times as much to factorise.
class NewtonDirection {
 public:
  /// @param mechanics  must outlive the object
  explicit NewtonDirection(const Mechanics& mechanics);

  /// Step for the deformed shape.
  /// @param sums  residual, energy and tangent at @p state; where that tangent is not positive definite it is evaluated
  ///   with Demand::convex too, and may be left so
  /// @param tolerance  of the linear solve, relative to |r|, in (0, 1)
  /// @param moved_mm   how far the last step went: what says whether the kept factor is still close
  /// @param step  out: s, mm, dof 3 node + axis; one of descent of the energy where there is one
  /// @return false when no step was found
  /// @throws NumericalFailure  out of memory
  bool deformed(const State& state, double tolerance, double moved_mm, Sums& sums, Eigen::VectorXd& step);

  /// Step for the undeformed shape. @p sums holds residual and reference tangent at @p state; else as deformed().
  bool undeformed(const State& state, double tolerance, Sums& sums, Eigen::VectorXd& step);

  /// How far the kept factor would move the nodes to take @p residual away, mm: root of the sum of squares. The measure
  /// of progress that does not depend on how stiff a body is in which direction (Deuflhard, Newton Methods for
  /// Nonlinear Problems, 2004, section 3.3); not a number without a factor.
  /// @param residual  mN, dof 3 node + axis
  double natural_mm(const Eigen::VectorXd& residual);

  /// Forgets the kept factor, so that what follows does not depend on what was solved before.
  void forget();

  /// Whether the last step came from the exact tangent: its length then says how far the answer is.
  bool exact() const { return exact_; }
  /// How many there were since the object was made, those that failed included.
  int factorisations() const { return factorisations_; }
  /// The same of Krylov iterations with a cycle of multigrid; beside a factor they cost little.
  int cycles() const { return cycles_; }

 private:
  bool factorise(const State& state, double tolerance, bool close, Sums& sums, Eigen::VectorXd* step);
  bool with_factor_instead(const State& state, double tolerance, bool close, Sums& sums, Eigen::VectorXd* step);
  void evaluate(const State& state, bool convex, Sums& sums) const;
  bool step_with_new_factor(const State& state, double tolerance, double shift, Sums& sums, Eigen::VectorXd& step);
  bool by_conjugate_gradients(double tolerance, double shift, int max_iterations, const Sums& sums,
                              Eigen::VectorXd& step);
  bool by_gmres(const SparseMatrix& matrix, const LinearMap& preconditioner, double tolerance, const Sums& sums,
                Eigen::VectorXd& step);
  int iterations_per_factor(int least, int most) const;
  const SparseMatrix& whole(const Sums& sums);
  void choose_solver(const SparseMatrix& pattern);
  bool cycling() const { return factor_ != nullptr && factor_ == cycle_.get(); }

  const Mechanics& mechanics_;
  std::unique_ptr<SpdSolver> cycle_, large_;  // p-multigrid; what make_spd_solver() gives
  SpdSolver* factor_ = nullptr;               // one of them: the one made last
  SparseMatrix couplings_;                    // zeros: of the mesh and all that has touched; empty while nothing has
  SparseMatrix whole_;                        // work space
  Krylov krylov_;
  Eigen::VectorXd preconditioned_residual_, bend_;  // work space
  bool have_factor_ = false;
  bool renew_factor_ = false;  // the last Krylov solve cost more than a new factor would
  bool exact_ = true;
  bool convex_factor_ = false;  // the kept factor is of a changed tangent
  bool indefinite_ = false;     // the last exact tangent that was asked has shown negative curvature
  double shift_ = 0;            // of the tangent that was factorised last when the exact one was not positive definite
  bool cycle_failed_ = false;   // p-multigrid did not come to a solution: not tried again
  int factorisations_ = 0;
  int cycles_ = 0;
};

}  // namespace supine::simulation
