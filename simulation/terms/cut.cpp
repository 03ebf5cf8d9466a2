// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/cut.h"

#include <utility>

#include "simulation/elements/surface_geometry.h"

namespace supine::simulation {

template <class Face>
CutTerm<Face>::CutTerm(const Indices& faces, const Pattern& pattern, Eigen::VectorXd share)
    : elements_(faces, pattern), share_(std::move(share)) {}

template <class Face>
void CutTerm<Face>::set_fields(const Fields<double>& fields) {
  stiffness_ = fields.cut_stiffness;
  if (share_.size() > 0) stiffness_.array() *= share_.array();
}

template <class Face>
void CutTerm<Face>::add(const State& state, const Demand& demand, Sums& sums) const {
  constexpr int n = Face::nodes;
  add_elements<n>(elements_, demand, sums, [this, &state, &demand](int e, auto& local) {
    const NodeRows<n> rest = gather<n>(state.X, elements_.nodes(), e);
    const NodeRows<n> moved = gather<n>(state.x, elements_.nodes(), e) - rest;
    for (int p = 0; p < Face::points; ++p) {
      const double k = stiffness_[e * Face::points + p];
      const auto& value = Face::table().value[p];
      const Eigen::Vector3d u = moved.transpose() * value;
      const Eigen::Matrix3d spring = k * Eigen::Matrix3d::Identity();
      add_point_density<Face>(face_point<Face>(rest, p), value, 0.5 * k * u.squaredNorm(), k * u, spring, -spring,
                              demand, local);
    }
  });
}

template <class Face>
void CutTerm<Face>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  constexpr int n = Face::nodes;
  add_elements<n>(elements_, Demand{.residual = true}, sums, [this, &state, &fields](int e, auto& local) {
    const NodeRows<n> rest = gather<n>(state.X, elements_.nodes(), e);
    const NodeRows<n> moved = gather<n>(state.x, elements_.nodes(), e) - rest;
    for (int p = 0; p < Face::points; ++p) {
      const auto& value = Face::table().value[p];
      const Eigen::Vector3d force =
          share(e * Face::points + p) * fields.cut_stiffness[e * Face::points + p].v[0] * (moved.transpose() * value);
      const double area = face_point<Face>(rest, p).area;
      for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += area * value[a] * force;
    }
  });
}

template class CutTerm<Tri3>;
template class CutTerm<Tri6>;

}  // namespace supine::simulation
