// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/gravity.h"

#include "simulation/elements/tet_geometry.h"

namespace supine::simulation {

template <class Element>
GravityTerm<Element>::GravityTerm(const Indices& cells, const Pattern& pattern, const Points& imaged,
                                  DensityReference reference)
    : elements_(cells, pattern), given_(imaged), imaged_(imaged), reference_(reference) {}

template <class Element>
void GravityTerm<Element>::set_fields(const Fields<double>& fields) {
  weight_ = fields.density * fields.gravity.transpose();
  imaged_ = given_ + Eigen::Map<const Points>(fields.imaged_offset.data(), given_.rows(), 3);
}

template <class Element>
void GravityTerm<Element>::add_force(const State& state, const Points& weight, const Demand& demand, Sums& sums) const {
  constexpr int n = Element::nodes;
  const bool varies = reference_ == DensityReference::undeformed;
  const Points& shape = varies ? state.X : imaged_;
  add_elements<n>(elements_, demand, sums, [&](int e, auto& local) {
    const Eigen::Vector3d pull = state.load * weight.row(e).transpose();
    const NodeRows<n> rest = gather<n>(shape, elements_.nodes(), e);
    const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e);
    for (int p = 0; p < Element::points; ++p) {
      const auto point = tet_point<Element>(rest, p);
      if (!(point.det > 0)) return;
      const auto& value = Element::table().value[p];
      if (demand.energy) local.energy -= point.volume * pull.dot(x.transpose() * value);
      if (demand.residual)
        for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) -= point.volume * value[a] * pull;
      if (demand.reference_tangent && varies)
        for (int a = 0; a < n; ++a)
          for (int b = 0; b < n; ++b)
            local.reference_tangent.template block<3, 3>(3 * a, 3 * b) -=
                point.volume * value[a] * pull * point.b.row(b);
    }
  });
}

template <class Element>
void GravityTerm<Element>::add(const State& state, const Demand& demand, Sums& sums) const {
  Demand needed = demand;
  needed.tangent = false;  // a dead load has none
  if (!needed.energy && !needed.residual && !needed.reference_tangent) return;
  add_force(state, weight_, needed, sums);
}

template <class Element>
void GravityTerm<Element>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  Points derivative(elements_.count(), 3);
  for (Eigen::Index e = 0; e < elements_.count(); ++e)
    for (int i = 0; i < 3; ++i) derivative(e, i) = (fields.density[e] * fields.gravity[i]).v[0];
  if ((derivative.array() != 0).any()) add_force(state, derivative, Demand{.residual = true}, sums);
  if (reference_ == DensityReference::undeformed) return;
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
