// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/bulk_laws.h"

#include <ceres/jet.h>

namespace supine::simulation {
namespace {

// P = μ (e F - G) + λ ln J G with G = F^{-T}, e = exp(b (I1 - 3)).
void neo_hookean_tangent(const Matrix3& f, const BulkMaterial<double>& m, Matrix3& stress, Tangent9& tangent) {
  const Matrix3 g = f.inverse().transpose();
  const double log_j = std::log(f.determinant());
  const double growth = std::exp(m.stiffening * (f.squaredNorm() - 3.0));
  const double c = m.mu_kpa - m.lambda_kpa * log_j;
  stress = (m.mu_kpa * growth) * f - c * g;
  const double stiffening = 2 * m.stiffening * m.mu_kpa * growth;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          tangent(3 * i + j, 3 * k + l) =
              m.lambda_kpa * g(i, j) * g(k, l) + c * g(i, l) * g(k, j) + stiffening * f(i, j) * f(k, l);
  tangent.diagonal().array() += m.mu_kpa * growth;
}

// With F = R S: dR = R [ω]×, (tr S I - S) ω = 2 axial(skew(Rᵀ dF)), so that RᵀR stays I and RᵀF symmetric.
void corotational_tangent(const Matrix3& f, const BulkMaterial<double>& m, Matrix3& stress, Tangent9& tangent) {
  const Matrix3 r = polar_rotation(f);
  const Matrix3 s = r.transpose() * f;
  const double dilation = s.trace() - 3.0;
  stress = 2 * m.mu_kpa * (f - r) + m.lambda_kpa * dilation * r;
  const Matrix3 spin = (s.trace() * Matrix3::Identity() - 0.5 * (s + s.transpose())).inverse();
  const double rotating = m.lambda_kpa * dilation - 2 * m.mu_kpa;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) {
      // Rᵀ dF for dF = e_k ⊗ e_l has the single non-zero column l: row k of R.
      Eigen::Vector3d twice_axial = Eigen::Vector3d::Zero();
      const Eigen::Vector3d row = r.row(k).transpose();
      twice_axial = Eigen::Vector3d::Unit(l).cross(row);
      const Eigen::Vector3d omega = spin * twice_axial;
      Matrix3 cross;
      cross << 0, -omega.z(), omega.y(), omega.z(), 0, -omega.x(), -omega.y(), omega.x(), 0;
      Matrix3 d = rotating * r * cross + m.lambda_kpa * r(k, l) * r;
      d(k, l) += 2 * m.mu_kpa;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) tangent(3 * i + j, 3 * k + l) = d(i, j);
    }
}

void qr_tangent(const Matrix3& f, const BulkMaterial<double>& m, const Eigen::Matrix<double, 3, 2>& rest,
                Matrix3& stress, Tangent9& tangent) {
  using Jet = ceres::Jet<double, 9>;
  Eigen::Matrix<Jet, 3, 3> fj;
  for (int i = 0; i < 9; ++i) fj(i / 3, i % 3) = Jet(f(i / 3, i % 3), i);
  const Eigen::Matrix<Jet, 3, 2> rj = rest.cast<Jet>();
  const auto p = corotated_stress<Jet, Jet>(fj, qr_rotation<Jet>(fj, rj), Jet(m.mu_kpa), Jet(m.lambda_kpa));
  for (int i = 0; i < 9; ++i) {
    stress(i / 3, i % 3) = p(i / 3, i % 3).a;
    tangent.row(i) = p(i / 3, i % 3).v.transpose();
  }
}

}  // namespace

Matrix3 polar_rotation(const Matrix3& f) {
  Matrix3 r = f;
  for (int iteration = 0; iteration < 60; ++iteration) {
    const Matrix3 next = 0.5 * (r + r.inverse().transpose());
    const double change = (next - r).squaredNorm();
    r = next;
    if (change < 1e-30) break;
  }
  return r;
}

double bulk_energy(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m) {
  if (law == BulkLaw::corotational) {
    const Matrix3 r = polar_rotation(f);
    const double dilation = r.cwiseProduct(f).sum() - 3.0;
    return m.mu_kpa * (f - r).squaredNorm() + 0.5 * m.lambda_kpa * dilation * dilation;
  }
  const double log_j = std::log(f.determinant());
  const double excess = f.squaredNorm() - 3.0;
  const double stretch = m.stiffening == 0 ? excess : std::expm1(m.stiffening * excess) / m.stiffening;
  return 0.5 * m.mu_kpa * (stretch - 2 * log_j) + 0.5 * m.lambda_kpa * log_j * log_j;
}

void bulk_tangent(BulkLaw law, const Matrix3& f, const BulkMaterial<double>& m, const Eigen::Matrix<double, 3, 2>& rest,
                  Matrix3& stress, Tangent9& tangent) {
  switch (law) {
    case BulkLaw::neo_hookean:
      return neo_hookean_tangent(f, m, stress, tangent);
    case BulkLaw::corotational:
      return corotational_tangent(f, m, stress, tangent);
    case BulkLaw::corotational_qr:
      return qr_tangent(f, m, rest, stress, tangent);
  }
}

Eigen::Matrix<double, 9, 6> qr_rest_derivative(const Matrix3& f, const BulkMaterial<double>& m,
                                               const Eigen::Matrix<double, 3, 2>& rest) {
  using Jet = ceres::Jet<double, 6>;
  Eigen::Matrix<Jet, 3, 2> rj;
  for (int c = 0; c < 2; ++c)
    for (int k = 0; k < 3; ++k) rj(k, c) = Jet(rest(k, c), 3 * c + k);
  const Eigen::Matrix<Jet, 3, 3> fj = f.cast<Jet>();
  const auto p = corotated_stress<Jet, Jet>(fj, qr_rotation<Jet>(fj, rj), Jet(m.mu_kpa), Jet(m.lambda_kpa));
  Eigen::Matrix<double, 9, 6> derivative;
  for (int i = 0; i < 9; ++i) derivative.row(i) = p(i / 3, i % 3).v.transpose();
  return derivative;
}

}  // namespace supine::simulation
