// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/interface.h"

#include "simulation/surface_geometry.h"

namespace supine::simulation {

template <class Face>
InterfaceTerm<Face>::InterfaceTerm(const Indices& faces, const Pattern& pattern,
                                   std::shared_ptr<const meshing::MuscleDistance> muscle)
    : elements_(faces, pattern),
      muscle_(std::move(muscle)),
      at_x_(elements_.count() * Face::points),
      at_X_(elements_.count() * Face::points) {}

template <class Face>
void InterfaceTerm<Face>::set_fields(const Fields<double>& fields) {
  normal_ = fields.interface_normal;
  tangential_ = fields.interface_tangential;
}

template <class Face>
const typename InterfaceTerm<Face>::Sample& InterfaceTerm<Face>::look_up(std::vector<Cached>& cache, int point,
                                                                         const Eigen::Vector3d& at) const {
  Cached& entry = cache[point];
  if (entry.at != at) {
    entry.sample = muscle_->at(at);
    entry.at = at;
  }
  return entry.sample;
}

template <class Face>
void InterfaceTerm<Face>::add_face(int e, const State& state, const Demand& demand, Local<Face::nodes>& local) const {
  constexpr int n = Face::nodes;
  const NodeRows<n> nodes = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
  for (int p = 0; p < Face::points; ++p) {
    const int index = e * Face::points + p;
    const auto& value = Face::table().value[p];
    const Eigen::Vector3d x = nodes.transpose() * value, X = rest.transpose() * value;
    const Sample& now = look_up(at_x_, index, x);
    const Sample& before = look_up(at_X_, index, X);
    const double kn = normal_[index], kt = tangential_[index];
    const double gap = now.value_mm - before.value_mm;
    const double steepness = before.gradient.norm();
    const Eigen::Vector3d normal = before.gradient / steepness, slip = x - X;
    const double along = normal.dot(slip);
    const Eigen::Matrix3d tangential = Eigen::Matrix3d::Identity() - normal * normal.transpose();

    const double energy = 0.5 * kn * gap * gap + 0.5 * kt * (slip.squaredNorm() - along * along);
    const Eigen::Vector3d ex = kn * gap * now.gradient + kt * (slip - along * normal);
    Eigen::Matrix3d exx, exX;
    if (demand.tangent || demand.reference_tangent) {
      exx = kn * (now.gradient * now.gradient.transpose() + gap * now.hessian) + kt * tangential;
      const Eigen::Matrix3d normal_X = tangential * before.hessian / steepness;
      exX = -kn * now.gradient * before.gradient.transpose() -
            kt * (tangential + along * normal_X + normal * (slip.transpose() * normal_X));
    }
    add_point_density<Face>(face_point<Face>(rest, p), value, energy, ex, exx, exX, demand, local);
  }
}

template <class Face>
void InterfaceTerm<Face>::add(const State& state, const Demand& demand, Sums& sums) const {
  add_elements<Face::nodes>(elements_, demand, sums,
                            [this, &state, &demand](int e, auto& local) { add_face(e, state, demand, local); });
}

template <class Face>
void InterfaceTerm<Face>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  constexpr int n = Face::nodes;
  add_elements<n>(elements_, Demand{.residual = true}, sums, [this, &state, &fields](int e, auto& local) {
    const NodeRows<n> nodes = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
    for (int p = 0; p < Face::points; ++p) {
      const int index = e * Face::points + p;
      const auto& value = Face::table().value[p];
      const Eigen::Vector3d x = nodes.transpose() * value, X = rest.transpose() * value;
      const Sample& now = look_up(at_x_, index, x);
      const Sample& before = look_up(at_X_, index, X);
      const Eigen::Vector3d normal = before.gradient.normalized(), slip = x - X;
      const Eigen::Vector3d force =
          fields.interface_normal[index].v[0] * (now.value_mm - before.value_mm) * now.gradient +
          fields.interface_tangential[index].v[0] * (slip - normal.dot(slip) * normal);
      const double area = face_point<Face>(rest, p).area;
      for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += area * value[a] * force;
    }
  });
}

template class InterfaceTerm<Tri3>;
template class InterfaceTerm<Tri6>;

}  // namespace supine::simulation
