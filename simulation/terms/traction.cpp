// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/traction.h"

#include "simulation/elements/surface_geometry.h"

namespace supine::simulation {

template <class Face>
TractionTerm<Face>::TractionTerm(const Indices& faces, const Pattern& pattern) : elements_(faces, pattern) {}

template <class Face>
void TractionTerm<Face>::set_fields(const Fields<double>& fields) {
  traction_ = Eigen::Map<const Points>(fields.skin_traction.data(), elements_.count(), 3);
  loaded_ = (traction_.array() != 0).any();
}

template <class Face>
void TractionTerm<Face>::add_force(const State& state, const Points& traction, const Demand& demand, Sums& sums) const {
  constexpr int n = Face::nodes;
  add_elements<n>(elements_, demand, sums, [&](int e, auto& local) {
    const Eigen::Vector3d pull = state.load * traction.row(e).transpose();
    const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
    for (int p = 0; p < Face::points; ++p) {
      const auto& value = Face::table().value[p];
      const FacePoint<Face> point = face_point<Face>(rest, p);
      local.energy -= point.area * pull.dot(x.transpose() * value);
      for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) -= point.area * value[a] * pull;
      if (!demand.reference_tangent) continue;
      for (int a = 0; a < n; ++a)
        for (int b = 0; b < n; ++b)
          local.reference_tangent.template block<3, 3>(3 * a, 3 * b) -= value[a] * pull * point.area_X.row(b);
    }
  });
}

template <class Face>
void TractionTerm<Face>::add(const State& state, const Demand& demand, Sums& sums) const {
  Demand needed = demand;
  needed.tangent = false;  // a dead load has none
  if (loaded_ && (needed.energy || needed.residual || needed.reference_tangent))
    add_force(state, traction_, needed, sums);
}

template <class Face>
void TractionTerm<Face>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  Points derivative(elements_.count(), 3);
  for (Eigen::Index i = 0; i < derivative.size(); ++i) derivative.data()[i] = fields.skin_traction[i].v[0];
  if ((derivative.array() != 0).any()) add_force(state, derivative, Demand{.residual = true}, sums);
}

template class TractionTerm<Tri3>;
template class TractionTerm<Tri6>;

}  // namespace supine::simulation
