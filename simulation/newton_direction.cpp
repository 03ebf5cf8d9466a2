// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/newton_direction.h"

#include <algorithm>
#include <limits>

namespace supine::simulation {
namespace {

constexpr int max_gmres = 120;
constexpr int max_conjugate_gradients = 200;
constexpr double shift_growth = 6;        // from one try to the next
constexpr double close_mm = 1;            // a kept factor is worth trying on a small mesh after steps shorter than this
constexpr double usable_reduction = 0.5;  // a linear solve that got this far is still a direction
constexpr double worth_reduction = 0.1;   // and this far one that saves a new factor

}  // namespace

NewtonDirection::NewtonDirection(const Mechanics& mechanics)
    : mechanics_(mechanics), krylov_(mechanics.pattern().dofs()) {}

bool NewtonDirection::deformed(const State& state, double tolerance, double moved_mm, Sums& sums,
                               Eigen::VectorXd& step) {
  exact_ = true;
  if (!mechanics_.has_energy()) {  // ∂r/∂x is not symmetric: its lower half only preconditions
    if ((!have_factor_ || outworn_) && !factorise(state, tolerance, sums, nullptr)) return false;
    if (!exact_) mechanics_.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true}, sums);
    exact_ = true;  // the factor may be of a changed tangent, GMRES solves with the matrix itself
    return by_gmres(sums.tangent, 1, tolerance, sums, step);
  }
  const bool worth_trying = have_factor_ && !outworn_ && (moved_mm < close_mm || factor_->solves_per_factor() > 12);
  if (worth_trying) {
    const int most = std::clamp(static_cast<int>(factor_->solves_per_factor()), 4, max_conjugate_gradients);
    if (by_conjugate_gradients(tolerance, 0, most, sums, step)) return true;
  }
  return factorise(state, tolerance, sums, &step);
}

bool NewtonDirection::undeformed(const State& state, double tolerance, Sums& sums, Eigen::VectorXd& step) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    const bool fresh = !have_factor_ || outworn_;
    if (fresh) {
      mechanics_.evaluate(state, Demand{.residual = true, .tangent = true, .reference_tangent = true}, sums);
      if (!factorise(state, tolerance, sums, nullptr)) return false;
    }
    exact_ = true;  // the factor may be of a changed tangent, GMRES solves with the matrix itself
    if (by_gmres(sums.reference_tangent, -1, tolerance, sums, step)) return true;
    if (fresh) return false;
    outworn_ = true;
  }
  return false;
}

double NewtonDirection::natural_mm(const Eigen::VectorXd& residual) {
  if (!have_factor_) return std::numeric_limits<double>::quiet_NaN();
  factor_->solve(residual, natural_);
  return natural_.norm();
}

/// @param step  the Newton step with the new factor, or nullptr when only the factor is wanted
bool NewtonDirection::factorise(const State& state, double tolerance, Sums& sums, Eigen::VectorXd* step) {
  if (!factor_) factor_ = make_spd_solver(sums.tangent, mechanics_.mesh().points);
  // The exact tangent where it is positive definite; where it is not, the one without the skin's negative curvature;
  // and if the tissue's is negative too, with a shift not much larger than makes it so: tried from a little under the
  // last one that did.
  double shift = 0;
  have_factor_ = true;
  for (int attempt = 0; attempt < 10; ++attempt) {
    ++factorisations_;
    exact_ = attempt == 0;
    if (factor_->factorise(sums.tangent, shift)) {
      bool found = true;
      if (step != nullptr && factor_->direct()) {
        factor_->solve(-sums.residual, *step);
        found = step->allFinite();
      } else if (step != nullptr) {
        found = by_conjugate_gradients(tolerance, shift, max_conjugate_gradients, sums, *step);
      }
      outworn_ = attempt > 0;  // a changed tangent is good for this step only
      if (found) {
        if (attempt > 0) shift_ = shift;
        return true;
      }
    }
    if (attempt == 0)
      mechanics_.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true, .convex = true}, sums);
    else if (attempt == 1)
      shift = std::max(1e-4 * sums.tangent.diagonal().cwiseAbs().mean(), shift_ / shift_growth);
    else
      shift *= shift_growth;
  }
  have_factor_ = false;
  return false;
}

bool NewtonDirection::by_conjugate_gradients(double tolerance, double shift, int most, const Sums& sums,
                                             Eigen::VectorXd& step) {
  const auto matrix = [&sums, shift](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    out.noalias() = sums.tangent.transpose() * in;  // symmetric; the transposed product runs in parallel
    if (shift != 0) out += shift * in;
  };
  const auto preconditioner = [this](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor_->solve(in, out); };
  const KrylovReport report =
      krylov_.conjugate_gradients(matrix, preconditioner, -sums.residual, tolerance, most, step);
  outworn_ = 2 * report.iterations > most;
  const bool usable = report.converged || (!report.negative_curvature && report.reduction <= worth_reduction);
  return usable && step.allFinite();
}

bool NewtonDirection::by_gmres(const SparseMatrix& matrix, double sign, double tolerance, const Sums& sums,
                               Eigen::VectorXd& step) {
  const auto product = [&matrix](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out.noalias() = matrix * in; };
  const auto preconditioner = [this, sign](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    factor_->solve(in, out);
    out *= sign;
  };
  const KrylovReport report = krylov_.gmres(product, preconditioner, -sums.residual, tolerance, max_gmres, step);
  outworn_ = report.iterations > std::clamp(static_cast<int>(factor_->solves_per_factor()), 8, max_gmres);
  return report.reduction < usable_reduction && step.allFinite();
}

}  // namespace supine::simulation
