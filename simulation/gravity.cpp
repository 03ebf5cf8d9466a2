// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/gravity.h"

#include "simulation/tet_geometry.h"

namespace supine::simulation {

template <class Element>
GravityTerm<Element>::GravityTerm(const Indices& cells, const Pattern& pattern, const Points& imaged,
                                  DensityReference reference)
    : elements_(cells, pattern), imaged_(imaged), reference_(reference) {}

template <class Element>
void GravityTerm<Element>::set_fields(const Fields<double>& fields) {
  weight_ = fields.density * fields.gravity.transpose();
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
  add_force(state, derivative, Demand{.residual = true}, sums);
}

template class GravityTerm<Tet4>;
template class GravityTerm<Tet10>;

}  // namespace supine::simulation
