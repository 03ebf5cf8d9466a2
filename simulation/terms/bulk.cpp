// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/bulk.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "simulation/elements/tet_geometry.h"
#include "simulation/laws/invariant_kernel.h"
#include "simulation/terms/constant.h"

namespace supine::simulation {
namespace {

constexpr double many_shear_moduli = 20;  // of κ: nearly incompressible

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

/// The quadrature points of a cell, deformed, and its mean dilation θ̄ = Σ V θ / Σ V, where θ is J or, for the
/// corotational law, tr U - 3.
template <class Element>
struct CellStrain {
  static constexpr int n = Element::nodes;
  struct Point {
    TetPoint<Element> rest;
    Matrix3 f;
    double det_f, theta;
  };
  std::array<Point, Element::points> points;
  double least_det_f = 1e300;
  double volume = 0, mean = 0;       // Σ V, θ̄; only with an excess
  Nodal<n> by_x = Nodal<n>::Zero();  // Σ V ∂θ/∂x
  Nodal<n> by_X = Nodal<n>::Zero();  // Σ V ∂θ/∂X + Σ (θ - θ̄) ∂V/∂X

  CellStrain(BulkLaw law, const NodeRows<n>& x, const NodeRows<n>& rest, bool averaged) {
    for (int p = 0; p < Element::points; ++p) {
      auto& [place, f, det_f, theta] = points[p];
      place = tet_point<Element>(rest, p);
      det_f = place.det;
      if (place.det > 0) {
        f.noalias() = x.transpose() * place.b;
        det_f = f.determinant();
      }
      least_det_f = std::min(least_det_f, det_f);
      if (!(least_det_f > 0)) return;
      if (!averaged) continue;
      theta = is_invariant_law(law) ? det_f : PolarPoint(f).dilation;
      volume += place.volume;
      mean += place.volume * theta;
    }
    if (averaged) mean /= volume;
  }

  void add_slope(BulkLaw law, const Point& point) {
    add_slope(point, is_invariant_law(law)
                         ? Nodal<n>(point.det_f * (point.rest.b * InvariantStrain(point.f, point.det_f).g.transpose()))
                         : Nodal<n>(point.rest.b * PolarPoint(point.f).r.transpose()));
  }
  /// @param slope  ∂θ/∂F B_a
  void add_slope(const Point& point, const Nodal<n>& slope) {
    by_x += point.rest.volume * slope;
    by_X += point.rest.volume * ((point.theta - mean) * point.rest.b - slope * point.f);
  }

  /// The part of the matrices in which θ̄ varies; the rest goes through the pressure at the points.
  void add_mean(double stiffness, const Demand& demand, ElementSums<n>& sums) const {
    if (demand.tangent) sums.add_outer(by_x, by_x, stiffness / volume, true);
    if (demand.reference_tangent) sums.add_reference_outer(by_x, by_X, stiffness / volume);
  }
};

constexpr Demand unit_demand{.residual = true, .tangent = true};

Tangent9 tangent_of(const InvariantStrain& strain, const InvariantResponse<double>& response) {
  ElementSums<3> sums;
  sums.clear(unit_demand);
  add_invariant_point<3>(strain, response, unit_gradients, 1, unit_demand, sums);
  return point_tangent(sums, true);
}

Tangent9 tangent_of(const PolarPoint& polar, const BulkMaterial<double>& m, double pressure) {
  ElementSums<3> sums;
  sums.clear(unit_demand);
  add_polar_point<3>(polar, m, pressure, unit_gradients, 1, unit_demand, sums);
  return point_tangent(sums, true);
}

VolumeStrain mean_strain(BulkLaw law, double mean) {
  if (law == BulkLaw::corotational) return {mean, 1, 0};
  return volume_strain(law, mean);
}

}  // namespace

std::string locking_warning(int order, const Eigen::VectorXd& poisson, Volumetric volumetric) {
  constexpr double linear_limit = 0.46, pointwise_limit = 0.48;
  const double highest = poisson.size() > 0 ? poisson.maxCoeff() : 0;
  if (order == 1 && highest > linear_limit)
    return fmt::format(
        "Poisson's ratio {:.4g} with linear tetrahedra: they lock, and move too little by a third and more; use a mesh "
        "of quadratic ones (supine-tetrahedralise --order 2)",
        highest);
  if (order == 2 && volumetric == Volumetric::pointwise && highest > pointwise_limit)
    return fmt::format(
        "Poisson's ratio {:.4g} with breast.volumetric = \"pointwise\": quadratic tetrahedra lock; leave volumetric "
        "out or write \"mean\"",
        highest);
  return {};
}

template <class T>
SplitLambda<T> split_lambda(const BulkMaterial<T>& m) {
  using std::exp;
  const T knee = pointwise_lambda_over_mu * m.mu_kpa;
  if (!(m.lambda_kpa > knee)) return {m.lambda_kpa, T(0.0)};
  const T over = m.lambda_kpa - knee, pointwise = knee * (2.0 - exp(-over / knee));
  return {pointwise, m.lambda_kpa - pointwise};
}

template <class Element>
BulkTerm<Element>::BulkTerm(std::shared_ptr<const Elements> cells, const BulkSettings& settings)
    : shared_(std::move(cells)), elements_(*shared_), settings_(settings) {
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
  const bool averaged = excess > 0, slopes = averaged && (demand.tangent || demand.reference_tangent);
  CellStrain<Element> strain(law, x, rest, averaged);
  local.min_det_f = std::min(local.min_det_f, strain.least_det_f);
  if (!(local.min_det_f > 0)) return;
  const VolumeStrain mean = averaged ? mean_strain(law, strain.mean) : VolumeStrain{0, 0, 0};
  const double strain_of_pressure = slopes && state.volume_strain ? (*state.volume_strain)[e] : mean.value;
  const double pressure = excess * strain_of_pressure * mean.first;
  if (demand.energy) local.energy += 0.5 * excess * strain.volume * mean.value * mean.value;

  const bool convex = demand.convex && demand.tangent;
  ElementSums<n> sums;
  sums.clear(demand);
  for (const auto& point : strain.points) {
    const auto& [place, f, det_f, theta] = point;
    if (is_invariant_law(law)) {
      const InvariantStrain s(f, det_f);
      const double margin = law_margin(law, s, material);
      if (!(margin > 0)) local.min_det_f = std::min(margin, 0.0);
      if (!(margin > 0)) return;
      auto response = invariant_response(law, s, material);
      if (demand.energy) local.energy += place.volume * response.energy;
      response.wl += pressure * det_f;
      response.wll += pressure * det_f;
      add_invariant_point<n>(s, response, place.b, place.volume, demand, sums);
      if (convex) take_off_negative_curvature<n>(tangent_of(s, response), place.b, place.volume, sums);
      if (slopes) strain.add_slope(point, det_f * (place.b * s.g.transpose()));
    } else if (law == BulkLaw::corotational) {
      const PolarPoint polar(f);
      if (demand.energy) local.energy += place.volume * polar.energy(material);
      add_polar_point<n>(polar, material, pressure, place.b, place.volume, demand, sums);
      if (convex) take_off_negative_curvature<n>(tangent_of(polar, material, pressure), place.b, place.volume, sums);
      if (slopes) strain.add_slope(point, place.b * polar.r.transpose());
    } else {
      add_qr_point<n>(f, rest_edges<n>(rest), material, place.b, place.volume, edge_ends<n>(), demand, sums);
    }
  }
  if (slopes) {
    const double stiffness = excess * (mean.first * mean.first + strain_of_pressure * mean.second);
    strain.add_mean(convex ? std::max(stiffness, 0.0) : stiffness, demand, sums);
    sums.force += (excess * (mean.value - strain_of_pressure) * mean.first) * strain.by_x;
  }
  sums.write(demand, law != BulkLaw::corotational_qr, local);
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
  const bool averaged = material.excess.a > 0;
  const CellStrain<Element> strain(law, x, rest, averaged);
  if (!(strain.least_det_f > 0)) return;
  const VolumeStrain mean = averaged ? mean_strain(law, strain.mean) : VolumeStrain{0, 0, 0};
  const Dual pressure = material.excess * (mean.value * mean.first);
  for (const auto& point : strain.points) {
    const auto stress = bulk_stress<Dual>(law, point.f, material.point, rest_edges<n>(rest), pressure);
    Matrix3 derivative;
    for (int i = 0; i < 9; ++i) derivative.data()[i] = stress.data()[i].v[0];
    const Nodal<n> force = point.rest.volume * point.rest.b * derivative.transpose();
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

template <class Element>
bool BulkTerm<Element>::nearly_incompressible() const {
  return std::any_of(material_.begin(), material_.end(),
                     [](const auto& m) { return m.excess > many_shear_moduli * m.point.mu_kpa; });
}

template <class Element>
void BulkTerm<Element>::volume_strain(const State& state, const Eigen::VectorXd& step, Eigen::VectorXd& strain,
                                      Eigen::VectorXd& change) const {
  constexpr int n = Element::nodes;
  const bool moves = step.size() > 0;
  strain.setZero(elements_.count());
  if (moves) change.setZero(elements_.count());
#pragma omp parallel for schedule(static)
  for (Eigen::Index e = 0; e < elements_.count(); ++e) {
    if (!(material_[e].excess > 0)) continue;
    CellStrain<Element> cell(settings_.law, gather<n>(state.x, elements_.nodes(), static_cast<int>(e)),
                             gather<n>(state.X, elements_.nodes(), static_cast<int>(e)), true);
    if (!(cell.least_det_f > 0)) continue;
    const VolumeStrain mean = mean_strain(settings_.law, cell.mean);
    strain[e] = mean.value;
    if (!moves) continue;
    for (const auto& point : cell.points) cell.add_slope(settings_.law, point);
    double dilation = 0;
    for (int a = 0; a < n; ++a) dilation += cell.by_x.row(a).dot(step.segment<3>(3 * elements_.nodes()(e, a)));
    change[e] = mean.first * dilation / cell.volume;
  }
}

template <class Element>
void BulkTerm<Element>::take_off_pressure_defect(const State& state, Eigen::VectorXd& residual) const {
  constexpr int n = Element::nodes;
  if (state.volume_strain == nullptr) return;
  for (int e = 0; e < elements_.count(); ++e) {
    const double excess = material_[e].excess;
    if (!(excess > 0)) continue;
    CellStrain<Element> cell(settings_.law, gather<n>(state.x, elements_.nodes(), e),
                             gather<n>(state.X, elements_.nodes(), e), true);
    if (!(cell.least_det_f > 0)) continue;
    for (const auto& point : cell.points) cell.add_slope(settings_.law, point);
    const VolumeStrain mean = mean_strain(settings_.law, cell.mean);
    const double defect = excess * (mean.value - (*state.volume_strain)[e]) * mean.first;
    for (int a = 0; a < n; ++a)
      residual.segment<3>(3 * elements_.nodes()(e, a)) -= defect * cell.by_x.row(a).transpose();
  }
}

template class BulkTerm<Tet4>;
template class BulkTerm<Tet10>;
template SplitLambda<double> split_lambda(const BulkMaterial<double>&);
template SplitLambda<Dual> split_lambda(const BulkMaterial<Dual>&);

}  // namespace supine::simulation
