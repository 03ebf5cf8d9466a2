// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/newton_direction.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <vector>

#include "simulation/solve/pushed_forward.h"

namespace supine::simulation {
namespace {

constexpr int max_gmres = 120;
constexpr int max_conjugate_gradients = 200;
constexpr double shift_growth = 6;        // from one try to the next
constexpr double close_mm = 1;            // a kept factor is worth trying after steps shorter than this
constexpr double many_solves = 40;        // or where a new one costs as much as so many solves
constexpr double usable_reduction = 0.5;  // a linear solve that got this far is still a direction
constexpr double worth_reduction = 0.1;   // and this far one that saves a new factor

}  // namespace

NewtonDirection::NewtonDirection(const Mechanics& mechanics)
    : mechanics_(mechanics), krylov_(mechanics.pattern().dofs()) {}

int NewtonDirection::worth_of_factor(int least, int most) const {
  return std::clamp(static_cast<int>(factor_->solves_per_factor()), least, most);
}

bool NewtonDirection::deformed(const State& state, double tolerance, double moved_mm, Sums& sums,
                               Eigen::VectorXd& step) {
  exact_ = true, bent_ = false;
  const bool close = moved_mm < close_mm;
  if (!mechanics_.has_energy()) {  // ∂r/∂x is not symmetric: its lower half only preconditions
    if ((!have_factor_ || outworn_) && !factorise(state, tolerance, close, sums, nullptr)) return false;
    if (!exact_) mechanics_.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true}, sums);
    exact_ = true;  // the factor may be of a changed tangent, GMRES solves with the matrix itself
    const auto preconditioner = [this](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor_->solve(in, out); };
    return by_gmres(sums.tangent, preconditioner, tolerance, sums, step);
  }
  const bool worth_trying = have_factor_ && !outworn_ && (close || factor_->solves_per_factor() >= many_solves);
  if (worth_trying && by_conjugate_gradients(tolerance, 0, worth_of_factor(4, max_conjugate_gradients), sums, step))
    return true;
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
  bent_ = false;
  for (int attempt = 0; attempt < 2; ++attempt) {
    const bool fresh = !have_factor_ || outworn_;
    if (fresh) {
      mechanics_.evaluate(state, Demand{.residual = true, .tangent = true, .reference_tangent = true}, sums);
      if (!factorise(state, tolerance, false, sums, nullptr)) return false;
    }
    exact_ = true;  // the factor may be of a changed tangent, GMRES solves with the matrix itself
    if (by_gmres(sums.reference_tangent, preconditioner, tolerance, sums, step)) return true;
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

/// @param close  whether the last step was short
/// @param step   the Newton step with the new factor, or nullptr when only the factor is wanted
bool NewtonDirection::factorise(const State& state, double tolerance, bool close, Sums& sums, Eigen::VectorXd* step) {
  if (!factor_) factor_ = make_spd_solver(sums.tangent, mechanics_.mesh().points);
  // The exact tangent where it is positive definite; where it is not, the one without the skin's negative curvature;
  // and if the tissue's is negative too, with a shift not much larger than makes it so: tried from a little under the
  // last one that did.
  double shift = 0;
  have_factor_ = true;
  for (int attempt = bent_ ? 1 : 0; attempt < 10; ++attempt) {
    if (attempt == 1)
      mechanics_.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true, .convex = true}, sums);
    else if (attempt == 2)
      shift = std::max(1e-4 * sums.tangent.diagonal().cwiseAbs().mean(), shift_ / shift_growth);
    else if (attempt > 2)
      shift *= shift_growth;
    ++factorisations_;
    exact_ = attempt == 0;
    if (!factor_->factorise(sums.tangent, shift)) continue;
    outworn_ = false;
    const bool found = step == nullptr || step_with_new_factor(state, tolerance, shift, close, sums, *step);
    // A cycle of multigrid is no factor: it is good for a changed tangent, not for what that was changed from.
    if (attempt > 0 && !factor_->direct()) outworn_ = true;
    if (found && attempt > 0) shift_ = shift;
    if (found) return true;
  }
  have_factor_ = false;
  return false;
}

bool NewtonDirection::step_with_new_factor(const State& state, double tolerance, double shift, bool close, Sums& sums,
                                           Eigen::VectorXd& step) {
  const bool exact = exact_;
  if (!exact && close && factor_->direct()) {
    mechanics_.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true}, sums);
    if (by_conjugate_gradients(tolerance, 0, worth_of_factor(4, max_conjugate_gradients), sums, step)) return true;
  }
  bool found = true;
  if (factor_->direct())
    factor_->solve(-sums.residual, step);
  else
    found = by_conjugate_gradients(tolerance, shift, max_conjugate_gradients, sums, step);
  exact_ = exact;
  return found && step.allFinite();
}

/// With the kept factor on sums.tangent. Sets exact_ and bent_ by whether that showed negative curvature.
bool NewtonDirection::by_conjugate_gradients(double tolerance, double shift, int most, const Sums& sums,
                                             Eigen::VectorXd& step) {
  const auto matrix = [&sums, shift](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    out.noalias() = sums.tangent.transpose() * in;  // symmetric; the transposed product runs in parallel
    if (shift != 0) out += shift * in;
  };
  const auto preconditioner = [this](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor_->solve(in, out); };
  const double worth = factor_->direct() ? worth_reduction : std::numeric_limits<double>::infinity();
  const KrylovReport report =
      krylov_.conjugate_gradients(matrix, preconditioner, -sums.residual, tolerance, most, step, worth);
  outworn_ = 2 * report.iterations > most;
  bent_ = report.negative_curvature;
  exact_ = !bent_;
  const double enough = bent_ && factor_->direct() ? usable_reduction : worth_reduction;
  const bool usable = report.converged || ((factor_->direct() || !bent_) && report.reduction <= enough);
  return usable && step.allFinite();
}

bool NewtonDirection::by_gmres(const SparseMatrix& matrix, const LinearMap& preconditioner, double tolerance,
                               const Sums& sums, Eigen::VectorXd& step) {
  const auto product = [&matrix](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out.noalias() = matrix * in; };
  const KrylovReport report = krylov_.gmres(product, preconditioner, -sums.residual, tolerance, max_gmres, step);
  outworn_ = report.iterations > worth_of_factor(8, max_gmres);
  return report.reduction < usable_reduction && step.allFinite();
}

}  // namespace supine::simulation
