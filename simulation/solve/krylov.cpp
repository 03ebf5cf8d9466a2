// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/krylov.h"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>

namespace supine::simulation {
namespace {

constexpr int first_judged = 6;         // iterations: the residual goes up and down before it falls steadily
constexpr int gram_schmidt_passes = 2;  // one loses orthogonality when the residual has fallen far

}  // namespace

KrylovReport Krylov::conjugate_gradients(const LinearMap& matrix, const LinearMap& preconditioner,
                                         const Eigen::VectorXd& b, const KrylovOptions& options, Eigen::VectorXd& x,
                                         Eigen::VectorXd* way) {
  for (Eigen::VectorXd* work : {&r_, &z_, &p_, &q_}) work->resize(size_);
  KrylovReport report;
  x.setZero(size_);
  const double norm = b.norm();
  report.converged = norm == 0;
  if (report.converged) return report;
  r_ = b;
  double rho = 0;
  while (report.iterations < options.max_iterations) {
    preconditioner(r_, z_);
    const double rho_before = rho;
    rho = r_.dot(z_);
    if (report.iterations == 0)
      p_ = z_;
    else
      p_ = z_ + (rho / rho_before) * p_;
    matrix(p_, q_);
    const double curvature = p_.dot(q_);
    report.negative_curvature = !(curvature > 0);
    if (report.negative_curvature && way != nullptr) *way = p_;
    if (report.negative_curvature) return report;
    ++report.iterations;
    const double alpha = rho / curvature;
    x += alpha * p_;
    r_ -= alpha * q_;
    report.reduction = r_.norm() / norm;
    report.converged = report.reduction <= options.tolerance;
    const double share_of_iterations = static_cast<double>(report.iterations) / options.max_iterations;
    const double on_schedule = std::pow(options.worthwhile_reduction, share_of_iterations);
    if (report.converged || (report.iterations >= first_judged && report.reduction > on_schedule)) break;
  }
  return report;
}

KrylovReport Krylov::gmres(const LinearMap& matrix, const LinearMap& preconditioner, const Eigen::VectorXd& b,
                           const KrylovOptions& options, Eigen::VectorXd& x) {
  const int max_iterations = options.max_iterations;
  q_.resize(size_);
  if (basis_.cols() < max_iterations + 1) basis_.resize(size_, max_iterations + 1);
  KrylovReport report;
  x.setZero(size_);
  const double norm = b.norm();
  report.converged = norm == 0;
  if (report.converged) return report;
  basis_.col(0) = b / norm;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(max_iterations + 1, max_iterations);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(max_iterations + 1);
  g[0] = 1;
  std::vector<Eigen::JacobiRotation<double>> rotations(max_iterations);
  int k = 0;
  while (k < max_iterations && !report.converged) {
    if (static_cast<int>(preconditioned_.size()) == k) preconditioned_.emplace_back(size_);
    q_ = basis_.col(k);
    preconditioner(q_, preconditioned_[k]);
    matrix(preconditioned_[k], q_);
    for (int pass = 0; pass < gram_schmidt_passes; ++pass) {
      const Eigen::VectorXd along = basis_.leftCols(k + 1).transpose() * q_;
      q_.noalias() -= basis_.leftCols(k + 1) * along;
      h.col(k).head(k + 1) += along;
    }
    h(k + 1, k) = q_.norm();
    if (h(k + 1, k) > 0) basis_.col(k + 1) = q_ / h(k + 1, k);
    for (int i = 0; i < k; ++i) h.col(k).applyOnTheLeft(i, i + 1, rotations[i].adjoint());
    rotations[k].makeGivens(h(k, k), h(k + 1, k));
    h.col(k).applyOnTheLeft(k, k + 1, rotations[k].adjoint());
    g.applyOnTheLeft(k, k + 1, rotations[k].adjoint());
    ++k;
    report.reduction = std::abs(g[k]);
    report.converged = report.reduction <= options.tolerance;
  }
  report.iterations = k;
  const Eigen::VectorXd y = h.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(g.head(k));
  for (int i = 0; i < k; ++i) x += (norm * y[i]) * preconditioned_[i];
  return report;
}

}  // namespace supine::simulation
