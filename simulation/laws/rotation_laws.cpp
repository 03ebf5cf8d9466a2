// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/laws/rotation_laws.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace supine::simulation {
namespace {

Matrix3 cross_matrix(const Eigen::Vector3d& v) {
  Matrix3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// How a frame turns when its edges move: spin vector = Σ_c turn[c] δedge_c.
/// With columns q of the frame, e0 = |e0| q0 and e1 = (q0·e1) q0 + s q1: the spin has component -q2·δe0/|e0| along q1,
/// q1·δe0/|e0| along q2, and (q2·δe1 - (q0·e1) q2·δe0/|e0|)/s along q0.
std::array<Matrix3, 2> frame_spin(const Matrix3& q, const Edges& edges) {
  const double length = edges.col(0).norm(), along = q.col(0).dot(edges.col(1)), across = q.col(1).dot(edges.col(1));
  const Eigen::RowVector3d lift = q.col(2).transpose() / length;
  return {q.col(2) * q.col(1).transpose() / length - q.col(1) * lift - q.col(0) * lift * (along / across),
          q.col(0) * q.col(2).transpose() / across};
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

Matrix3 frame_of_edges(const Edges& edges) {
  Matrix3 q;
  q.col(0) = edges.col(0).normalized();
  q.col(1) = (edges.col(1) - q.col(0) * q.col(0).dot(edges.col(1))).normalized();
  q.col(2) = q.col(0).cross(q.col(1));
  return q;
}

Matrix3 qr_rotation(const Matrix3& f, const Edges& rest) {
  return frame_of_edges(f * rest) * frame_of_edges(rest).transpose();
}

PolarPoint::PolarPoint(const Matrix3& deformation) : f(deformation), r(polar_rotation(deformation)) {
  u = r.transpose() * f;
  dilation = u.trace() - 3;
}

// δR = R [ω]ₓ with (tr U 1 - U) ω = 2 axial(skew(Rᵀ δF)), so that R stays a rotation and RᵀF symmetric. With
// (R (tr U 1 - U)⁻¹ Rᵀ) = Σ_c c cᵀ (its Cholesky factor), r_a = R B_a and z_a = r_a × c:
//   B_a·A·B_b = 2μ D_ab 1 + λ r_a r_bᵀ + (λ θ + p - 2μ) Σ_c z_a z_bᵀ.
template <int N>
void add_polar_point(const PolarPoint& point, const BulkMaterial<double>& m, double pressure, const Nodal<N>& b,
                     double volume, const Demand& demand, ElementSums<N>& sums) {
  const double turning = m.lambda_kpa * point.dilation + pressure - 2 * m.mu_kpa;
  const Nodal<N> r = b * point.r.transpose();
  const Nodal<N> force = volume * (2 * m.mu_kpa * (b * point.f.transpose()) + turning * r);
  sums.force += force;
  if (!demand.tangent && !demand.reference_tangent) return;

  const Eigen::Matrix<double, N, N> spread = (2 * volume * m.mu_kpa) * b.lazyProduct(b.transpose());
  const Matrix3 spin = (point.u.trace() * Matrix3::Identity() - 0.5 * (point.u + point.u.transpose())).inverse();
  const Matrix3 factor = point.r * Matrix3(spin.llt().matrixL());
  std::array<Nodal<N>, 3> z;
  for (int c = 0; c < 3; ++c) z[c] = -r * cross_matrix(factor.col(c)).transpose();
  if (demand.tangent) {
    for (int i = 0; i < 3; ++i) sums.tangent[4 * i] += spread;
    sums.add_outer(r, r, volume * m.lambda_kpa, true);
    for (const auto& way : z) sums.add_outer(way, way, volume * turning, true);
  }
  if (!demand.reference_tangent) return;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) sums.reference[3 * i + k] -= point.f(i, k) * spread;
  sums.add_reference_outer(r, r * point.f, -volume * m.lambda_kpa);
  for (const auto& way : z) sums.add_reference_outer(way, way * point.f, -volume * turning);
  sums.add_reference_outer(force, b, 1);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) sums.reference[3 * i + k].noalias() -= b.col(k) * force.col(i).transpose();
}

// Let F move by δF and R by [w]ₓ R. Then δP = μ (δF + R δFᵀ R) + λ tr(RᵀδF) R + Y(w), and Y(w) B_a = Y_a w below.
template <int N>
void add_qr_point(const Matrix3& f, const Edges& rest, const BulkMaterial<double>& m, const Nodal<N>& b, double volume,
                  const Eigen::Matrix<double, N, 2>& corner, const Demand& demand, ElementSums<N>& sums) {
  const Edges deformed = f * rest;
  const Matrix3 now = frame_of_edges(deformed), before = frame_of_edges(rest), r = now * before.transpose();
  const Matrix3 p = corotated_stress<double>(f, r, m.mu_kpa, m.lambda_kpa);
  const Nodal<N> force = volume * b * p.transpose();
  sums.force += force;
  if (!demand.tangent && !demand.reference_tangent) return;

  const auto spin = frame_spin(now, deformed), rest_spin = frame_spin(before, rest);
  const Matrix3 fr = f * r.transpose(), rf = r * f.transpose();
  const Eigen::RowVector3d axial(fr(1, 2) - fr(2, 1), fr(2, 0) - fr(0, 2), fr(0, 1) - fr(1, 0));
  const auto edge_share = [&](int n) -> Eigen::RowVector2d { return b.row(n) * rest; };
  for (int a = 0; a < N; ++a) {
    const Eigen::Vector3d fa = f * b.row(a).transpose(), ra = r * b.row(a).transpose();
    const Matrix3 turn = m.mu_kpa * (cross_matrix(fa) - rf * cross_matrix(ra)) -
                         cross_matrix(p * b.row(a).transpose()) - m.lambda_kpa * ra * axial;
    for (int n = 0; n < N; ++n) {
      const Eigen::Vector3d rn = r * b.row(n).transpose();
      const Eigen::RowVector2d share = edge_share(n);
      Matrix3 k = m.mu_kpa * rn * ra.transpose() + m.lambda_kpa * ra * rn.transpose() +
                  turn * (share[0] * spin[0] + share[1] * spin[1]);
      k.diagonal().array() += m.mu_kpa * b.row(a).dot(b.row(n));
      Matrix3 l = -volume * k * f + force.row(a).transpose() * b.row(n) - force.row(n).transpose() * b.row(a);
      for (int c = 0; c < 2; ++c) l += (volume * corner(n, c)) * turn * (spin[c] * f - r * rest_spin[c]);
      for (int i = 0; i < 9; ++i) {
        if (demand.tangent) sums.tangent[i](a, n) += volume * k(i / 3, i % 3);
        if (demand.reference_tangent) sums.reference[i](a, n) += l(i / 3, i % 3);
      }
    }
  }
}

#define SUPINE_ROTATION_LAWS(N)                                                                                     \
  template void add_polar_point<N>(const PolarPoint&, const BulkMaterial<double>&, double, const Nodal<N>&, double, \
                                   const Demand&, ElementSums<N>&);                                                 \
  template void add_qr_point<N>(const Matrix3&, const Edges&, const BulkMaterial<double>&, const Nodal<N>&, double, \
                                const Eigen::Matrix<double, N, 2>&, const Demand&, ElementSums<N>&);
SUPINE_ROTATION_LAWS(3)   // N unit directions: the law's own tangent
SUPINE_ROTATION_LAWS(4)   // linear tetrahedra
SUPINE_ROTATION_LAWS(10)  // quadratic ones
#undef SUPINE_ROTATION_LAWS

}  // namespace supine::simulation
