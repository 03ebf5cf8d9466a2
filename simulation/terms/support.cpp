// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/support.h"

#include <Eigen/Geometry>

#include "simulation/elements/surface_geometry.h"
#include "simulation/terms/constant.h"

namespace supine::simulation {

template <class Face>
SupportTerm<Face>::SupportTerm(const Indices& faces, const Pattern& pattern, const Points& imaged,
                               Eigen::Index first_point)
    : elements_(faces, pattern), normal_(faces.rows() * Face::points, 3), first_point_(first_point) {
  for (int f = 0; f < faces.rows(); ++f) {
    const auto nodes = gather<Face::nodes>(imaged, faces, f);
    for (int p = 0; p < Face::points; ++p) {
      const Eigen::Matrix<double, 3, 2> tangent = nodes.transpose() * Face::table().gradient[p];
      normal_.row(f * Face::points + p) = tangent.col(0).cross(tangent.col(1)).normalized().transpose();
    }
  }
}

template <class Face>
void SupportTerm<Face>::set_fields(const Fields<double>& fields) {
  along_ = fields.interface_normal.segment(first_point_, normal_.rows());
  across_ = fields.interface_tangential.segment(first_point_, normal_.rows());
}

template <class Face>
Eigen::Matrix3d SupportTerm<Face>::spring(Eigen::Index point, double normal, double tangential) const {
  const Eigen::Vector3d n = normal_.row(point).transpose();
  return tangential * Eigen::Matrix3d::Identity() + (normal - tangential) * n * n.transpose();
}

template <class Face>
void SupportTerm<Face>::add(const State& state, const Demand& demand, Sums& sums) const {
  constexpr int n = Face::nodes;
  add_elements<n>(elements_, demand, sums, [this, &state, &demand](int e, auto& local) {
    const NodeRows<n> rest = gather<n>(state.X, elements_.nodes(), e);
    const NodeRows<n> moved = gather<n>(state.x, elements_.nodes(), e) - rest;
    for (int p = 0; p < Face::points; ++p) {
      const Eigen::Index point = e * Face::points + p;
      const auto& value = Face::table().value[p];
      const Eigen::Vector3d u = moved.transpose() * value;
      const Eigen::Matrix3d k = spring(point, along_[point], across_[point]);
      const Eigen::Vector3d pull = k * u;
      add_point_density<Face>(face_point<Face>(rest, p), value, 0.5 * u.dot(pull), pull, k, -k, demand, local);
    }
  });
}

template <class Face>
void SupportTerm<Face>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  constexpr int n = Face::nodes;
  add_elements<n>(elements_, Demand{.residual = true}, sums, [this, &state, &fields](int e, auto& local) {
    const NodeRows<n> rest = gather<n>(state.X, elements_.nodes(), e);
    const NodeRows<n> moved = gather<n>(state.x, elements_.nodes(), e) - rest;
    for (int p = 0; p < Face::points; ++p) {
      const Eigen::Index point = e * Face::points + p;
      const Dual &along = fields.interface_normal[first_point_ + point],
                 &across = fields.interface_tangential[first_point_ + point];
      if (constant({along, across})) continue;
      const auto& value = Face::table().value[p];
      const Eigen::Vector3d force = spring(point, along.v[0], across.v[0]) * (moved.transpose() * value);
      const double area = face_point<Face>(rest, p).area;
      for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += area * value[a] * force;
    }
  });
}

template class SupportTerm<Tri3>;
template class SupportTerm<Tri6>;

}  // namespace supine::simulation
