// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/bulk.h"

#include "common/error.h"
#include "simulation/tet_geometry.h"

namespace supine::simulation {
namespace {

template <int N>
Eigen::Matrix<double, 3, 2> rest_edges(const NodeRows<N>& nodes) {
  Eigen::Matrix<double, 3, 2> edges;
  edges.col(0) = nodes.row(1) - nodes.row(0);
  edges.col(1) = nodes.row(2) - nodes.row(0);
  return edges;
}

// K_{ai,bk} += V A_{iJkL} B_aJ B_bL.
template <int N>
void add_tangent(const Tangent9& a, const Eigen::Matrix<double, N, 3>& b, double volume,
                 Eigen::Matrix<double, 3 * N, 3 * N>& tangent) {
  for (int n = 0; n < N; ++n) {
    Eigen::Matrix<double, 9, 3> t;  // A_{iJkL} B_nL at row 3i+J, column k
    for (int k = 0; k < 3; ++k) t.col(k).noalias() = a.template middleCols<3>(3 * k) * b.row(n).transpose();
    for (int m = 0; m < N; ++m)
      for (int i = 0; i < 3; ++i)
        tangent.template block<1, 3>(3 * m + i, 3 * n).noalias() +=
            volume * (b.row(m) * t.template middleRows<3>(3 * i));
  }
}

// L_{ai,bK} += -K_{ai,bm} F_mK + V (B_bK (P B_a)_i - (P B_b)_i B_aK), K being this point's share.
template <int N>
void add_reference_tangent(const Eigen::Matrix<double, 3 * N, 3 * N>& point_tangent, const Matrix3& f,
                           const Eigen::Matrix<double, N, 3>& force, const Eigen::Matrix<double, N, 3>& b,
                           Eigen::Matrix<double, 3 * N, 3 * N>& out) {
  for (int n = 0; n < N; ++n) {
    out.template middleCols<3>(3 * n).noalias() -= point_tangent.template middleCols<3>(3 * n) * f;
    for (int m = 0; m < N; ++m)
      out.template block<3, 3>(3 * m, 3 * n) +=
          force.row(m).transpose() * b.row(n) - force.row(n).transpose() * b.row(m);
  }
}

// Dependence of the QR rotation on the undeformed edges at fixed F.
template <int N>
void add_qr_reference_tangent(const Eigen::Matrix<double, 9, 6>& d, const Eigen::Matrix<double, N, 3>& b, double volume,
                              Eigen::Matrix<double, 3 * N, 3 * N>& out) {
  for (int m = 0; m < N; ++m)
    for (int i = 0; i < 3; ++i) {
      const Eigen::Matrix<double, 1, 6> row = volume * b.row(m) * d.template middleRows<3>(3 * i);
      out.template block<1, 3>(3 * m + i, 3) += row.template head<3>();
      out.template block<1, 3>(3 * m + i, 6) += row.template tail<3>();
      out.template block<1, 3>(3 * m + i, 0) -= row.template head<3>() + row.template tail<3>();
    }
}

}  // namespace

template <class Element>
BulkTerm<Element>::BulkTerm(const Indices& cells, const Pattern& pattern, BulkLaw law)
    : elements_(cells, pattern), law_(law) {
  if (law == BulkLaw::corotational_qr && Element::nodes != 4)
    throw InputError(
        "breast.law = corotational_qr needs linear tetrahedra: make the mesh with --order 1, or use corotational");
}

template <class Element>
void BulkTerm<Element>::set_fields(const Fields<double>& fields) {
  material_.resize(elements_.count());
  for (Eigen::Index c = 0; c < elements_.count(); ++c)
    material_[c] = bulk_material(std::exp(fields.ln_young[c]), fields.poisson[c], fields.stiffening[c]);
}

template <class Element>
void BulkTerm<Element>::add_cell(int e, const State& state, const Demand& demand, Local<Element::nodes>& local) const {
  constexpr int n = Element::nodes;
  const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
  for (int p = 0; p < Element::points; ++p) {
    const auto point = tet_point<Element>(rest, p);
    const Matrix3 f = point.det > 0 ? Matrix3(x.transpose() * point.b) : Matrix3::Zero();
    const double det_f = point.det > 0 ? f.determinant() : point.det;
    local.min_det_f = std::min(local.min_det_f, det_f);
    if (!(det_f > 0)) return;
    const auto& material = material_[e];
    if (demand.energy && has_energy()) local.energy += point.volume * bulk_energy(law_, f, material);
    if (!demand.residual && !demand.tangent && !demand.reference_tangent) continue;

    Matrix3 stress;
    Tangent9 a;
    const auto edges = rest_edges<n>(rest);
    if (demand.tangent || demand.reference_tangent)
      bulk_tangent(law_, f, material, edges, stress, a);
    else
      stress = bulk_stress<double>(law_, f, material, edges);
    const Eigen::Matrix<double, n, 3> force = point.volume * point.b * stress.transpose();
    for (int m = 0; m < n; ++m) local.residual.template segment<3>(3 * m) += force.row(m).transpose();
    if (!demand.tangent && !demand.reference_tangent) continue;

    if (!demand.reference_tangent) {
      add_tangent<n>(a, point.b, point.volume, local.tangent);
      continue;
    }
    Eigen::Matrix<double, 3 * n, 3 * n> point_tangent = Eigen::Matrix<double, 3 * n, 3 * n>::Zero();
    add_tangent<n>(a, point.b, point.volume, point_tangent);
    add_reference_tangent<n>(point_tangent, f, force, point.b, local.reference_tangent);
    local.tangent += point_tangent;
    if (law_ == BulkLaw::corotational_qr)
      add_qr_reference_tangent<n>(qr_rest_derivative(f, material, edges), point.b, point.volume,
                                  local.reference_tangent);
  }
}

template <class Element>
void BulkTerm<Element>::add(const State& state, const Demand& demand, Sums& sums) const {
  add_elements<Element::nodes>(elements_, demand, sums,
                               [this, &state, &demand](int e, auto& local) { add_cell(e, state, demand, local); });
}

template <class Element>
void BulkTerm<Element>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  constexpr int n = Element::nodes;
  const Demand demand{.residual = true};
  add_elements<n>(elements_, demand, sums, [this, &state, &fields](int e, auto& local) {
    const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
    const auto material = bulk_material<Dual>(ceres::exp(fields.ln_young[e]), fields.poisson[e], fields.stiffening[e]);
    for (int p = 0; p < Element::points; ++p) {
      const auto point = tet_point<Element>(rest, p);
      if (!(point.det > 0)) return;
      const Matrix3 f = x.transpose() * point.b;
      const auto stress = bulk_stress<Dual>(law_, f, material, rest_edges<n>(rest));
      Matrix3 derivative;
      for (int i = 0; i < 9; ++i) derivative(i / 3, i % 3) = stress(i / 3, i % 3).v[0];
      const Eigen::Matrix<double, n, 3> force = point.volume * point.b * derivative.transpose();
      for (int m = 0; m < n; ++m) local.residual.template segment<3>(3 * m) += force.row(m).transpose();
    }
  });
}

template class BulkTerm<Tet4>;
template class BulkTerm<Tet10>;

}  // namespace supine::simulation
