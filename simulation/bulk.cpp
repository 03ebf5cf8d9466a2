// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/bulk.h"

#include <fmt/format.h>

#include "common/error.h"
#include "simulation/constant.h"
#include "simulation/laws/invariant_kernel.h"
#include "simulation/tet_geometry.h"

namespace supine::simulation {
namespace {

template <int N>
Edges rest_edges(const NodeRows<N>& nodes) {
  Edges edges;
  edges.col(0) = nodes.row(1) - nodes.row(0);
  edges.col(1) = nodes.row(2) - nodes.row(0);
  return edges;
}

/// ∂(rest edge c)/∂X_b, a multiple of the identity.
template <int N>
Eigen::Matrix<double, N, 2> edge_ends() {
  Eigen::Matrix<double, N, 2> ends = Eigen::Matrix<double, N, 2>::Zero();
  ends.row(0).setConstant(-1);
  ends(1, 0) = ends(2, 1) = 1;
  return ends;
}

/// A quadrature point with its deformation.
template <class Element>
struct CellPoint {
  TetPoint<Element> rest;
  Matrix3 f;
  double det_f;
};

/// Mean dilation of a cell, θ̄ = Σ V θ / Σ V, while its points are summed.
template <int N>
struct MeanDilation {
  double volume = 0, sum = 0;        // Σ V, Σ V θ
  Nodal<N> by_x = Nodal<N>::Zero();  // Σ V ∂θ/∂x
  Nodal<N> by_X = Nodal<N>::Zero();  // Σ V ∂θ/∂X + Σ (θ - θ̄) ∂V/∂X, with θ̄ known
  double mean() const { return sum / volume; }

  void add(double theta, double weight) {
    volume += weight;
    sum += weight * theta;
  }
  /// @param slope  ∂θ/∂F B_a of a point whose F is @p f
  void add_slope(double theta, const Nodal<N>& slope, const Nodal<N>& b, const Matrix3& f, double weight) {
    by_x += weight * slope;
    by_X += weight * ((theta - mean()) * b - slope * f);
  }
  /// The part of the matrices in which θ̄ varies; the rest goes through the pressure at the points.
  void add_to(double excess, const Demand& demand, ElementSums<N>& sums) const {
    const double scale = excess / volume;
    if (demand.tangent) sums.add_outer(by_x, by_x, scale, true);
    if (demand.reference_tangent) sums.add_reference_outer(by_x, by_X, scale);
  }
};

}  // namespace

template <class T>
SplitLambda<T> split_lambda(const BulkMaterial<T>& m) {
  using std::exp;
  const T knee = pointwise_lambda_over_mu * m.mu_kpa;
  if (!(m.lambda_kpa > knee)) return {m.lambda_kpa, T(0.0)};
  const T over = m.lambda_kpa - knee, pointwise = knee * (2.0 - exp(-over / knee));
  return {pointwise, m.lambda_kpa - pointwise};
}

template <class Element>
BulkTerm<Element>::BulkTerm(const Indices& cells, const Pattern& pattern, const BulkSettings& settings)
    : elements_(cells, pattern), settings_(settings) {
  if (settings.law == BulkLaw::corotational_qr && Element::nodes != 4)
    throw InputError(
        "breast.law = corotational_qr needs linear tetrahedra: make the mesh with --order 1, or use corotational");
}

template <class Element>
template <class T>
auto BulkTerm<Element>::cell_material(const Fields<T>& fields, Eigen::Index cell) const -> CellMaterial<T> {
  using std::exp;
  CellMaterial<T> material{bulk_material<T>(exp(fields.ln_young[cell]), fields.poisson[cell], fields.stiffening[cell]),
                           T(0.0)};
  material.point.shape = {fields.law_shape_1[cell], fields.law_shape_2[cell]};
  if (Element::points > 1 && settings_.volumetric == Volumetric::mean) {
    const auto split = split_lambda(material.point);
    material.point.lambda_kpa = split.pointwise;
    material.excess = split.excess;
  }
  return material;
}

template <class Element>
void BulkTerm<Element>::set_fields(const Fields<double>& fields) {
  material_.resize(elements_.count());
  for (Eigen::Index c = 0; c < elements_.count(); ++c) {
    material_[c] = cell_material(fields, c);
    const auto& m = material_[c].point;
    if (settings_.law == BulkLaw::mooney_rivlin && m.lambda_kpa < 2 * m.shape[0] * m.mu_kpa)
      throw InputError(fmt::format(
          "breast.mooney_share = {:.3g} is too much for the Poisson's ratio {:.3g} of cell {}: it must be at most "
          "ν/(1 - 2ν) = {:.3g}; raise breast.poisson_ratio or lower the share",
          m.shape[0], fields.poisson[c], c, 0.5 * m.lambda_kpa / m.mu_kpa));
  }
}

template <class Element>
void BulkTerm<Element>::add_cell(int e, const State& state, const Demand& demand, Local<Element::nodes>& local) const {
  constexpr int n = Element::nodes;
  const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
  const BulkLaw law = settings_.law;
  const auto& [material, excess] = material_[e];
  std::array<CellPoint<Element>, Element::points> points;
  MeanDilation<n> mean;
  for (int p = 0; p < Element::points; ++p) {
    auto& [place, f, det_f] = points[p];
    place = tet_point<Element>(rest, p);
    det_f = place.det;
    if (place.det > 0) {
      f.noalias() = x.transpose() * place.b;
      det_f = f.determinant();
    }
    local.min_det_f = std::min(local.min_det_f, det_f);
    if (!(det_f > 0)) return;
    if (excess > 0)
      mean.add(is_invariant_law(law) ? dilation(law, InvariantStrain(f, det_f)).value : PolarPoint(f).dilation,
               place.volume);
  }
  const double pressure = excess > 0 ? excess * mean.mean() : 0;
  if (excess > 0 && demand.energy) local.energy += 0.5 * pressure * mean.sum;

  const bool matrices = demand.tangent || demand.reference_tangent;
  ElementSums<n> sums;
  sums.clear(demand);
  for (const auto& [place, f, det_f] : points) {
    if (is_invariant_law(law)) {
      const InvariantStrain strain(f, det_f);
      const double margin = law_margin(law, strain, material);
      local.min_det_f = std::min(local.min_det_f, margin > 0 ? local.min_det_f : margin);
      if (!(margin > 0)) return;
      auto response = invariant_response(law, strain, material);
      if (demand.energy) local.energy += place.volume * response.energy;
      if (excess > 0) {
        const auto theta = dilation(law, strain);
        response.wl += pressure * theta.first;
        response.wll += pressure * theta.second;
        if (matrices)
          mean.add_slope(theta.value, theta.first * (place.b * strain.g.transpose()), place.b, f, place.volume);
      }
      if (demand.residual || matrices) add_invariant_point<n>(strain, response, place.b, place.volume, demand, sums);
    } else if (law == BulkLaw::corotational) {
      const PolarPoint point(f);
      if (demand.energy) local.energy += place.volume * point.energy(material);
      if (excess > 0 && matrices)
        mean.add_slope(point.dilation, place.b * point.r.transpose(), place.b, f, place.volume);
      if (demand.residual || matrices)
        add_polar_point<n>(point, material, pressure, place.b, place.volume, demand, sums);
    } else {
      add_qr_point<n>(f, rest_edges<n>(rest), material, place.b, place.volume, edge_ends<n>(), demand, sums);
    }
  }
  if (excess > 0 && matrices) mean.add_to(excess, demand, sums);
  if (demand.residual || matrices) sums.write(demand, law != BulkLaw::corotational_qr, local);
}

template <class Element>
void BulkTerm<Element>::add(const State& state, const Demand& demand, Sums& sums) const {
  add_elements<Element::nodes>(elements_, demand, sums,
                               [this, &state, &demand](int e, auto& local) { add_cell(e, state, demand, local); });
}

template <class Element>
void BulkTerm<Element>::add_cell_derivative(int e, const State& state, const CellMaterial<Dual>& material,
                                            Local<Element::nodes>& local) const {
  constexpr int n = Element::nodes;
  const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
  const BulkLaw law = settings_.law;
  std::array<CellPoint<Element>, Element::points> points;
  MeanDilation<n> mean;
  for (int p = 0; p < Element::points; ++p) {
    auto& [place, f, det_f] = points[p];
    place = tet_point<Element>(rest, p);
    if (!(place.det > 0)) return;
    f = x.transpose() * place.b;
    if (material.excess != Dual(0.0))
      mean.add(is_invariant_law(law) ? dilation(law, InvariantStrain(f)).value : PolarPoint(f).dilation, place.volume);
  }
  const Dual pressure = material.excess != Dual(0.0) ? Dual(material.excess * mean.mean()) : Dual(0.0);
  for (const auto& [place, f, det_f] : points) {
    const auto stress = bulk_stress<Dual>(law, f, material.point, rest_edges<n>(rest), pressure);
    Matrix3 derivative;
    for (int i = 0; i < 9; ++i) derivative.data()[i] = stress.data()[i].v[0];
    const Nodal<n> force = place.volume * place.b * derivative.transpose();
    for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += force.row(a).transpose();
  }
}

template <class Element>
void BulkTerm<Element>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  add_elements<Element::nodes>(elements_, Demand{.residual = true}, sums, [this, &state, &fields](int e, auto& local) {
    if (constant({fields.ln_young[e], fields.poisson[e], fields.stiffening[e], fields.law_shape_1[e],
                  fields.law_shape_2[e], fields.fibre_modulus[e]}))
      return;
    add_cell_derivative(e, state, cell_material(fields, e), local);
  });
}

template class BulkTerm<Tet4>;
template class BulkTerm<Tet10>;
template SplitLambda<double> split_lambda(const BulkMaterial<double>&);
template SplitLambda<Dual> split_lambda(const BulkMaterial<Dual>&);

}  // namespace supine::simulation
