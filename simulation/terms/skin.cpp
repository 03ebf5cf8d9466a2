// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin.h"

#include <ceres/jet.h>

#include <Eigen/Eigenvalues>
#include <utility>

#include "simulation/terms/constant.h"

namespace supine::simulation {
namespace {

/// Symmetric 2-by-2 matrix: entries 11, 12, 22.
template <class T>
using Metric = Eigen::Matrix<T, 3, 1>;

template <class T>
T determinant(const Metric<T>& m) {
  return m[0] * m[2] - m[1] * m[1];
}

Metric<double> metric(const Eigen::Matrix<double, 3, 2>& tangent) {
  return {tangent.col(0).squaredNorm(), tangent.col(0).dot(tangent.col(1)), tangent.col(1).squaredNorm()};
}

/// Energy per parent area and the stress components T^{αβ} = 2 ∂e/∂g_αβ.
template <class T>
struct MembranePoint {
  T energy;
  Metric<T> stress;
};

template <class T, class S>
MembranePoint<T> membrane_point(const SkinSettings& settings, const SkinMaterial<S>& material, const Metric<T>& g,
                                const Metric<T>& rest) {
  using std::sqrt;
  const T det_g = determinant(g), det_rest = determinant(rest);
  const S stretch2 = material.prestretch * material.prestretch;
  // Adjugates: inverse times determinant.
  const Metric<T> adj_rest(rest[2], -rest[1], rest[0]), adj_g(g[2], -g[1], g[0]);
  const PlaneInvariants<T> c{stretch2 * (adj_rest[0] * g[0] + 2.0 * adj_rest[1] * g[1] + adj_rest[2] * g[2]) / det_rest,
                             stretch2 * stretch2 * det_g / det_rest};
  const SkinEnergy<T> psi = skin_energy(settings, material, c);
  const T scale = material.modulus * sqrt(det_rest);
  const T wa = scale * 2.0 * psi.psi_a * stretch2 / det_rest;
  const T wb = scale * 2.0 * psi.psi_b * stretch2 * stretch2 / det_rest;
  return {scale * psi.psi, wa * adj_rest + wb * adj_g};
}

/// r_a = w Σ_αβ ∂_αN_a T^{αβ} e_β.
template <int N>
Eigen::Matrix<double, N, 3> membrane_force(const Eigen::Matrix<double, N, 2>& gradient, const Metric<double>& t,
                                           const Eigen::Matrix<double, 3, 2>& tangent, double weight) {
  Eigen::Matrix2d stress;
  stress << t[0], t[1], t[1], t[2];
  return weight * gradient * stress * tangent.transpose();
}

/// ∂(g11, g12, g22)/∂(node a): 3 by 3, rows the metric's entries.
template <int N>
Eigen::Matrix3d metric_derivative(const Eigen::Matrix<double, N, 2>& gradient, int a,
                                  const Eigen::Matrix<double, 3, 2>& tangent) {
  Eigen::Matrix3d d;
  d.row(0) = 2 * gradient(a, 0) * tangent.col(0).transpose();
  d.row(1) = gradient(a, 0) * tangent.col(1).transpose() + gradient(a, 1) * tangent.col(0).transpose();
  d.row(2) = 2 * gradient(a, 1) * tangent.col(1).transpose();
  return d;
}

/// The nearest positive semi-definite matrix.
template <int N>
Eigen::Matrix<double, N, N> convex_part(const Eigen::Matrix<double, N, N>& m) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eigen(0.5 * (m + m.transpose()));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

/// Stress of a membrane point and its derivatives with respect to both metrics.
struct MembraneTangent {
  double energy = 0;
  Metric<double> stress;
  Eigen::Matrix3d by_g, by_rest;  // ∂T/∂g, and ∂T/∂G where it is wanted
};

/// @tparam Variables  3: derivatives with respect to g alone, 6: to G as well
template <int Variables>
MembraneTangent membrane_tangent(const SkinSettings& settings, const SkinMaterial<double>& material,
                                 const Metric<double>& g, const Metric<double>& rest) {
  using Jet = ceres::Jet<double, Variables>;
  Metric<Jet> gj, rest_j;
  for (int i = 0; i < 3; ++i) {
    gj[i] = Jet(g[i], i);
    rest_j[i] = Variables == 6 ? Jet(rest[i], 3 + i) : Jet(rest[i]);
  }
  const auto point = membrane_point<Jet>(settings, material, gj, rest_j);
  MembraneTangent result;
  result.energy = point.energy.a;
  for (int i = 0; i < 3; ++i) {
    result.stress[i] = point.stress[i].a;
    result.by_g.row(i) = point.stress[i].v.template head<3>().transpose();
    if (Variables == 6) result.by_rest.row(i) = point.stress[i].v.template tail<3>().transpose();
  }
  return result;
}

/// Adds the tangents of one quadrature point.
/// @param now, before  deformed and undeformed tangent vectors of the parent coordinates
template <int N>
void add_membrane_tangent(const MembraneTangent& point, const Eigen::Matrix<double, N, 2>& gradient, double weight,
                          const Eigen::Matrix<double, 3, 2>& now, const Eigen::Matrix<double, 3, 2>& before,
                          const Demand& demand, Local<N>& local) {
  Eigen::Matrix2d stress;
  stress << point.stress[0], point.stress[1], point.stress[1], point.stress[2];
  // ½ because T^{αβ} = 2 ∂e/∂g_αβ; the off-diagonal entry stands for two.
  const Eigen::DiagonalMatrix<double, 3> half(0.5, 1, 0.5);
  Eigen::Matrix3d material = half * point.by_g;
  if (demand.convex) {
    stress = convex_part<2>(stress);
    material = convex_part<3>(material);
  }
  const Eigen::Matrix<double, N, N> geometric = weight * gradient * stress * gradient.transpose();
  for (int a = 0; a < N; ++a) {
    const Eigen::Matrix3d left = weight * metric_derivative<N>(gradient, a, now).transpose();
    const Eigen::Matrix3d to_x = left * material;
    Eigen::Matrix3d to_rest;
    if (demand.reference_tangent) to_rest = left * (half * point.by_rest);
    for (int b = 0; b < N; ++b) {
      auto block = local.tangent.template block<3, 3>(3 * a, 3 * b);
      block.noalias() += to_x * metric_derivative<N>(gradient, b, now);
      block.diagonal().array() += geometric(a, b);
      if (demand.reference_tangent)
        local.reference_tangent.template block<3, 3>(3 * a, 3 * b).noalias() +=
            to_rest * metric_derivative<N>(gradient, b, before);
    }
  }
}

template <class T>
SkinMaterial<T> skin_material(const Fields<T>& fields, Eigen::Index e) {
  return {fields.skin_modulus[e], fields.skin_poisson[e], fields.skin_compression[e], fields.skin_prestretch[e],
          fields.skin_stiffening[e]};
}

}  // namespace

const ShapeTable<3, 2, 1>& Tri3Centroid::table() {
  static const ShapeTable<3, 2, 1> table = {{Eigen::Vector3d::Constant(1.0 / 3)}, {Tri3::table().gradient[0]}, {0.5}};
  return table;
}

template <class Face>
SkinTerm<Face>::SkinTerm(const Indices& faces, const Pattern& pattern, const SkinSettings& settings,
                         Eigen::VectorXd share)
    : elements_(faces, pattern), settings_(settings), share_(std::move(share)) {}

template <class Face>
double SkinTerm<Face>::weight_of(int e, int p) const {
  return Face::table().weight[p] * (share_.size() > 0 ? share_[e * Face::points + p] : 1);
}

template <class Face>
void SkinTerm<Face>::set_fields(const Fields<double>& fields) {
  material_.resize(elements_.count());
  for (Eigen::Index e = 0; e < elements_.count(); ++e) material_[e] = skin_material(fields, e);
}

template <class Face>
void SkinTerm<Face>::add_face(int e, const State& state, const Demand& demand, Local<Face::nodes>& local) const {
  constexpr int n = Face::nodes;
  const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
  for (int p = 0; p < Face::points; ++p) {
    const auto& gradient = Face::table().gradient[p];
    const double weight = weight_of(e, p);
    const Eigen::Matrix<double, 3, 2> now = x.transpose() * gradient, before = rest.transpose() * gradient;
    MembraneTangent point;
    if (demand.tangent || demand.reference_tangent) {
      point = demand.reference_tangent ? membrane_tangent<6>(settings_, material_[e], metric(now), metric(before))
                                       : membrane_tangent<3>(settings_, material_[e], metric(now), metric(before));
      add_membrane_tangent<n>(point, gradient, weight, now, before, demand, local);
    } else {
      const auto plain = membrane_point<double>(settings_, material_[e], metric(now), metric(before));
      point.energy = plain.energy;
      point.stress = plain.stress;
    }
    local.energy += weight * point.energy;
    const auto force = membrane_force<n>(gradient, point.stress, now, weight);
    for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += force.row(a).transpose();
  }
}

template <class Face>
void SkinTerm<Face>::add(const State& state, const Demand& demand, Sums& sums) const {
  add_elements<Face::nodes>(elements_, demand, sums,
                            [this, &state, &demand](int e, auto& local) { add_face(e, state, demand, local); });
}

template <class Face>
void SkinTerm<Face>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  constexpr int n = Face::nodes;
  add_elements<n>(elements_, Demand{.residual = true}, sums, [this, &state, &fields](int e, auto& local) {
    if (constant({fields.skin_modulus[e], fields.skin_poisson[e], fields.skin_compression[e], fields.skin_prestretch[e],
                  fields.skin_stiffening[e]}))
      return;
    const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
    for (int p = 0; p < Face::points; ++p) {
      const auto& gradient = Face::table().gradient[p];
      const Eigen::Matrix<double, 3, 2> now = x.transpose() * gradient, before = rest.transpose() * gradient;
      const Metric<Dual> g = metric(now).template cast<Dual>(), rest_g = metric(before).template cast<Dual>();
      const auto point = membrane_point<Dual>(settings_, skin_material(fields, e), g, rest_g);
      const Metric<double> derivative(point.stress[0].v[0], point.stress[1].v[0], point.stress[2].v[0]);
      const auto force = membrane_force<n>(gradient, derivative, now, weight_of(e, p));
      for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += force.row(a).transpose();
    }
  });
}

template class SkinTerm<Tri3Centroid>;
template class SkinTerm<Tri6>;

}  // namespace supine::simulation
