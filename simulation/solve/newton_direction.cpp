// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/newton_direction.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <vector>

#include "simulation/solve/p_multigrid.h"
#include "simulation/solve/pushed_forward.h"

namespace supine::simulation {
namespace {

// Iterations, however cheap a new factor is and however dear.
constexpr int least_conjugate_gradients = 4, max_conjugate_gradients = 200;
constexpr int least_gmres = 8, max_gmres = 120;  // fewer at most: every iteration keeps a vector of the basis
// Which matrix is factorised: the exact tangent, the convex one, then that with growing shifts. The last shift is at
// least 28 times the mean of the diagonal: a step with so stiff a matrix leads nowhere.
constexpr int exact_tangent = 0, convex_tangent = 1, first_shifted = 2, max_tangents = 10;
constexpr double first_shift = 1e-4;  // share of the mean of the diagonal: small beside most stiffnesses
constexpr double shift_growth = 6;    // from one try to the next
// When the kept factor is used again, and when its Krylov solve will do.
constexpr double close_mm = 1;            // a kept factor is worth trying after steps shorter than this
constexpr double many_solves = 40;        // or where a new one costs as much as so many solves
constexpr double usable_reduction = 0.5;  // a linear solve that got this far is still a direction
constexpr double longest_bend_mm = 3;     // along a direction of negative curvature, before the line search
constexpr double worth_reduction = 0.1;   // and this far one that saves a new factor
constexpr int undeformed_tries = 3;  // with what is kept, then made anew, then with a factor where that was a cycle
constexpr Eigen::Index least_cycling = 3000;  // unknowns: a factor of fewer is as cheap as anything

}  // namespace

NewtonDirection::NewtonDirection(const Mechanics& mechanics)
    : mechanics_(mechanics), krylov_(mechanics.pattern().dofs()) {}

/// Krylov iterations that cost as much as a new factor, from @p least to @p most.
int NewtonDirection::iterations_per_factor(int least, int most) const {
  return std::clamp(static_cast<int>(factor_->solves_per_factor()), least, most);
}

void NewtonDirection::evaluate(const State& state, bool convex, Sums& sums) const {
  mechanics_.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true, .convex = convex}, sums);
}

bool NewtonDirection::deformed(const State& state, double tolerance, double moved_mm, Sums& sums,
                               Eigen::VectorXd& step) {
  exact_ = true;
  const bool close = moved_mm < close_mm;
  if (!mechanics_.has_energy()) {  // ∂r/∂x is not symmetric: its lower half only preconditions
    if ((!have_factor_ || renew_factor_) && !factorise(state, tolerance, close, sums, nullptr)) return false;
    if (!exact_) evaluate(state, false, sums);
    exact_ = true;  // the factor may be of a changed tangent, GMRES solves with the matrix itself
    const auto preconditioner = [this](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor_->solve(in, out); };
    return by_gmres(sums.whole_tangent(), preconditioner, tolerance, sums, step);
  }
  if (have_factor_ && !renew_factor_ && !cycling() && (close || factor_->solves_per_factor() >= many_solves)) {
    const int affordable = iterations_per_factor(least_conjugate_gradients, max_conjugate_gradients);
    if (by_conjugate_gradients(tolerance, 0, affordable, sums, step)) return true;
  }
  return factorise(state, tolerance, close, sums, &step);
}

bool NewtonDirection::undeformed(const State& state, double tolerance, Sums& sums, Eigen::VectorXd& step) {
  std::vector<Eigen::Matrix3d> back = nodal_deformation(mechanics_.mesh().cells, state.x, state.X);
  for (Eigen::Matrix3d& f : back) {
    if (!(f.determinant() > 0)) f.setIdentity();
    f = -f.inverse().eval();
  }
  const auto preconditioner = [this, &back](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    factor_->solve(in, out);
    for (std::size_t n = 0; n < back.size(); ++n) {
      auto at = out.segment<3>(3 * static_cast<Eigen::Index>(n));
      at = (back[n] * at).eval();
    }
  };
  indefinite_ = false;
  for (int attempt = 0; attempt < undeformed_tries; ++attempt) {
    const bool fresh = !have_factor_ || renew_factor_;
    if (fresh) {
      mechanics_.evaluate(state, Demand{.residual = true, .tangent = true, .reference_tangent = true}, sums);
      if (!factorise(state, tolerance, false, sums, nullptr)) return false;
    }
    exact_ = true;  // the factor may be of a changed tangent, GMRES solves with the matrix itself
    if (by_gmres(sums.reference_tangent, preconditioner, tolerance, sums, step)) return true;
    if (fresh && !cycling()) return false;
    if (fresh) cycle_failed_ = true;
    renew_factor_ = true;
  }
  return false;
}

double NewtonDirection::natural_mm(const Eigen::VectorXd& residual) {
  if (!have_factor_) return std::numeric_limits<double>::quiet_NaN();
  factor_->solve(residual, preconditioned_residual_);
  return preconditioned_residual_.norm();
}

/// What a factor is made of: the tangent, and what touches, in a pattern that holds every pair that has touched.
const SparseMatrix& NewtonDirection::whole(const Sums& sums) {
  if (sums.contact.nonZeros() == 0 && couplings_.nonZeros() == 0) return sums.tangent;
  whole_ = sums.whole_tangent();
  if (couplings_.nonZeros() > 0) whole_ = (whole_ + couplings_).eval();
  if (whole_.nonZeros() == couplings_.nonZeros()) return whole_;
  couplings_ = whole_;
  couplings_.coeffs().setZero();
  cycle_.reset();  // analysed for fewer
  large_.reset();
  return whole_;
}

void NewtonDirection::forget() {
  have_factor_ = false, shift_ = 0, cycle_failed_ = false, indefinite_ = false;
  if (couplings_.nonZeros() == 0) return;
  couplings_.resize(0, 0);
  cycle_.reset();
  large_.reset();
}

/// Points factor_ at what suits mesh and material.
void NewtonDirection::choose_solver(const SparseMatrix& pattern) {
  const bool cycle = mechanics_.mesh().order() == 2 && pattern.cols() >= least_cycling && !cycle_failed_ &&
                     !mechanics_.volume().nearly_incompressible();
  if (cycle && !cycle_) cycle_ = std::make_unique<PMultigrid>(pattern, mechanics_.mesh().cells);
  if (!cycle && !large_) large_ = make_spd_solver(pattern, mechanics_.mesh().points);
  factor_ = cycle ? cycle_.get() : large_.get();
}

/// Renews the kept factor.
/// @param close  whether the last step was short
/// @param step   the Newton step with the new factor, or nullptr when only the factor is wanted
bool NewtonDirection::factorise(const State& state, double tolerance, bool close, Sums& sums, Eigen::VectorXd* step) {
  // The exact tangent where it is positive definite; where it is not, or was not a step ago, the one without negative
  // curvature of tissue and skin; and if that will not do, with a shift not much larger than makes it do: tried from a
  // little under the last one that did.
  double shift = 0;
  have_factor_ = true;
  for (int tangent = indefinite_ ? convex_tangent : exact_tangent; tangent < max_tangents; ++tangent) {
    exact_ = tangent == exact_tangent;
    if (!exact_) evaluate(state, true, sums);
    if (tangent == first_shifted)
      shift = std::max(first_shift * sums.tangent.diagonal().cwiseAbs().mean(), shift_ / shift_growth);
    else if (tangent > first_shifted)
      shift *= shift_growth;
    ++factorisations_;
    const SparseMatrix& matrix = whole(sums);
    choose_solver(matrix);
    convex_factor_ = !exact_;
    if (!factor_->factorise(matrix, shift)) {
      if (cycling() && close) return with_factor_instead(state, tolerance, close, sums, step);
      continue;
    }
    renew_factor_ = false;
    const bool found = step == nullptr || step_with_new_factor(state, tolerance, shift, sums, *step);
    // A cycle of multigrid is no factor: it is good for a changed tangent, not for what that was changed from.
    if (convex_factor_ && !factor_->direct()) renew_factor_ = true;
    if (found && convex_factor_) shift_ = shift;
    if (found) return true;
    // Near the answer a changed tangent creeps, and its cycle is too poor for the exact one: a factor serves there.
    if (cycling() && (close || !indefinite_)) return with_factor_instead(state, tolerance, close, sums, step);
  }
  have_factor_ = false;
  return false;
}

/// The same where p-multigrid has come to no solution.
bool NewtonDirection::with_factor_instead(const State& state, double tolerance, bool close, Sums& sums,
                                          Eigen::VectorXd* step) {
  cycle_failed_ = true;
  if (!exact_) evaluate(state, false, sums);
  return factorise(state, tolerance, close, sums, step);
}

/// The step with the factor just made of sums.tangent + shift I. Where that is a changed tangent it preconditions the
/// exact one, if need be along a direction of negative curvature.
bool NewtonDirection::step_with_new_factor(const State& state, double tolerance, double shift, Sums& sums,
                                           Eigen::VectorXd& step) {
  if (convex_factor_) {
    evaluate(state, false, sums);
    const int affordable = factor_->direct() ? iterations_per_factor(least_conjugate_gradients, max_conjugate_gradients)
                                             : max_conjugate_gradients;
    if (by_conjugate_gradients(tolerance, 0, affordable, sums, step)) return true;
    exact_ = false;
    if (!factor_->direct()) evaluate(state, true, sums);
  }
  if (!factor_->direct()) return by_conjugate_gradients(tolerance, shift, max_conjugate_gradients, sums, step);
  factor_->solve(-sums.residual, step);
  return step.allFinite();
}

/// With the kept factor on sums.tangent + shift I. Sets exact_ and indefinite_ by whether that showed negative
/// curvature; if it did, the step goes on along it, as far as longest_bend_mm (Steihaug 1983): the line search finds
/// how far is good.
bool NewtonDirection::by_conjugate_gradients(double tolerance, double shift, int max_iterations, const Sums& sums,
                                             Eigen::VectorXd& step) {
  const auto matrix = [&sums, shift](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    out.noalias() = sums.tangent.transpose() * in;  // symmetric; the transposed product runs in parallel
    if (sums.contact.nonZeros() > 0) out.noalias() += sums.contact.transpose() * in;
    if (shift != 0) out += shift * in;
  };
  const auto preconditioner = [this](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor_->solve(in, out); };
  KrylovOptions options{.tolerance = tolerance, .max_iterations = max_iterations};
  if (factor_->direct()) options.worthwhile_reduction = worth_reduction;
  const KrylovReport report =
      krylov_.conjugate_gradients(matrix, preconditioner, -sums.residual, options, step, &bend_);
  if (cycling()) cycles_ += report.iterations;
  renew_factor_ = report.iterations > max_iterations / 2;  // the factor is kept for as long as it is clearly cheaper
  indefinite_ = report.negative_curvature;
  exact_ = !indefinite_;
  if (!indefinite_) return (report.converged || report.reduction <= worth_reduction) && step.allFinite();
  const double longest = bend_.cwiseAbs().maxCoeff();
  if (!convex_factor_ || !(longest > 0) || !(bend_.dot(sums.residual) < 0)) return false;
  step += longest_bend_mm / longest * bend_;
  return step.allFinite();
}

/// With the kept factor, maybe of another matrix, inside @p preconditioner.
bool NewtonDirection::by_gmres(const SparseMatrix& matrix, const LinearMap& preconditioner, double tolerance,
                               const Sums& sums, Eigen::VectorXd& step) {
  const auto product = [&matrix](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out.noalias() = matrix * in; };
  const KrylovOptions options{.tolerance = tolerance, .max_iterations = max_gmres};
  const KrylovReport report = krylov_.gmres(product, preconditioner, -sums.residual, options, step);
  if (cycling()) cycles_ += report.iterations;
  renew_factor_ = report.iterations > iterations_per_factor(least_gmres, max_gmres);
  return report.reduction < usable_reduction && step.allFinite();
}

}  // namespace supine::simulation
