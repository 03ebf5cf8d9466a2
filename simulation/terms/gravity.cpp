// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/gravity.h"

#include <utility>

#include "simulation/elements/tet_geometry.h"

namespace supine::simulation {

template <class Element>
GravityTerm<Element>::GravityTerm(std::shared_ptr<const Elements> cells, const Points& imaged,
                                  DensityReference reference)
    : shared_(std::move(cells)), elements_(*shared_), given_(imaged), imaged_(imaged), reference_(reference) {}

template <class Element>
void GravityTerm<Element>::set_fields(const Fields<double>& fields) {
  Points weight = fields.density * fields.gravity.transpose();
  Points imaged = given_ + Eigen::Map<const Points>(fields.imaged_offset.data(), given_.rows(), 3);
  const bool known = weight_.rows() == weight.rows() && weight == weight_ && imaged == imaged_;
  weight_ = std::move(weight);
  imaged_ = std::move(imaged);
  if (reference_ == DensityReference::imaged && !known) dead_load_ = nodal_forces(imaged_, weight_);
}

/// Of a weight per volume on a shape, 3 per node, mN.
template <class Element>
Eigen::VectorXd GravityTerm<Element>::nodal_forces(const Points& shape, const Points& weight) const {
  constexpr int n = Element::nodes;
  Eigen::VectorXd force = Eigen::VectorXd::Zero(given_.size());
  for (int e = 0; e < elements_.count(); ++e) {
    const NodeRows<n> rest = gather<n>(shape, elements_.nodes(), e);
    for (int p = 0; p < Element::points; ++p) {
      const auto point = tet_point<Element>(rest, p);
      if (!(point.det > 0)) break;
      const Eigen::Vector3d pull = point.volume * weight.row(e).transpose();
      for (int a = 0; a < n; ++a) force.segment<3>(3 * elements_.nodes()(e, a)) += Element::table().value[p][a] * pull;
    }
  }
  return force;
}

/// Of a mass that is density × undeformed volume.
template <class Element>
void GravityTerm<Element>::add_varying(const State& state, const Demand& demand, Sums& sums) const {
  constexpr int n = Element::nodes;
  add_elements<n>(elements_, demand, sums, [&](int e, auto& local) {
    const Eigen::Vector3d pull = state.load * weight_.row(e).transpose();
    const NodeRows<n> rest = gather<n>(state.X, elements_.nodes(), e);
    const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e);
    for (int p = 0; p < Element::points; ++p) {
      const auto point = tet_point<Element>(rest, p);
      if (!(point.det > 0)) return;
      const auto& value = Element::table().value[p];
      if (demand.energy) local.energy -= point.volume * pull.dot(x.transpose() * value);
      if (demand.residual)
        for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) -= point.volume * value[a] * pull;
      if (demand.reference_tangent)
        for (int a = 0; a < n; ++a)
          for (int b = 0; b < n; ++b)
            local.reference_tangent.template block<3, 3>(3 * a, 3 * b) -=
                point.volume * value[a] * pull * point.b.row(b);
    }
  });
}

template <class Element>
void GravityTerm<Element>::add(const State& state, const Demand& demand, Sums& sums) const {
  if (reference_ == DensityReference::imaged) {
    if (demand.energy)
      sums.energy -= state.load * dead_load_.dot(Eigen::Map<const Eigen::VectorXd>(state.x.data(), state.x.size()));
    if (demand.residual) sums.residual -= state.load * dead_load_;
    return;
  }
  Demand needed = demand;
  needed.tangent = false;  // the load does not follow the shape
  if (needed.energy || needed.residual || needed.reference_tangent) add_varying(state, needed, sums);
}

template <class Element>
void GravityTerm<Element>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  Points derivative(elements_.count(), 3);
  for (Eigen::Index e = 0; e < elements_.count(); ++e)
    for (int i = 0; i < 3; ++i) derivative(e, i) = (fields.density[e] * fields.gravity[i]).v[0];
  const bool varies = reference_ == DensityReference::undeformed;
  if ((derivative.array() != 0).any())
    sums.residual -= state.load * nodal_forces(varies ? state.X : imaged_, derivative);
  if (varies) return;
  Points velocity(given_.rows(), 3);
  for (Eigen::Index i = 0; i < velocity.size(); ++i) velocity.data()[i] = fields.imaged_offset[i].v[0];
  if ((velocity.array() != 0).any()) add_mass_derivative(state, velocity, sums);
}

// The volume of a quadrature point changes by its share of the divergence of the nodes' motion.
template <class Element>
void GravityTerm<Element>::add_mass_derivative(const State& state, const Points& imaged_velocity, Sums& sums) const {
  constexpr int n = Element::nodes;
  add_elements<n>(elements_, Demand{.residual = true}, sums, [&](int e, auto& local) {
    const Eigen::Vector3d pull = state.load * weight_.row(e).transpose();
    const NodeRows<n> imaged = gather<n>(imaged_, elements_.nodes(), e);
    const NodeRows<n> velocity = gather<n>(imaged_velocity, elements_.nodes(), e);
    for (int p = 0; p < Element::points; ++p) {
      const auto point = tet_point<Element>(imaged, p);
      if (!(point.det > 0)) return;
      const double volume_rate = point.volume * point.b.cwiseProduct(velocity).sum();
      for (int a = 0; a < n; ++a)
        local.residual.template segment<3>(3 * a) -= volume_rate * Element::table().value[p][a] * pull;
    }
  });
}

template class GravityTerm<Tet4>;
template class GravityTerm<Tet10>;

}  // namespace supine::simulation
