// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/interface.h"

#include "simulation/elements/surface_geometry.h"
#include "simulation/terms/constant.h"

namespace supine::simulation {
namespace {

template <class T>
ContactMaterial<T> contact_material(const Fields<T>& fields, Eigen::Index p, double load) {
  return {fields.interface_normal[p], fields.interface_tangential[p], fields.interface_friction[p],
          load * fields.muscle_offset[p]};
}

}  // namespace

template <class Face>
InterfaceTerm<Face>::InterfaceTerm(const Indices& faces, const Pattern& pattern,
                                   std::shared_ptr<const meshing::MuscleDistance> muscle, Eigen::Index first_point)
    : elements_(faces, pattern),
      muscle_(std::move(muscle)),
      first_point_(first_point),
      at_x_(elements_.count() * Face::points),
      at_X_(elements_.count() * Face::points) {}

template <class Face>
void InterfaceTerm<Face>::set_fields(const Fields<double>& fields) {
  material_.resize(at_x_.size());
  for (std::size_t p = 0; p < material_.size(); ++p)
    material_[p] = contact_material(fields, first_point_ + static_cast<Eigen::Index>(p), 1.0);
  rubs_ =
      (fields.interface_friction.segment(first_point_, static_cast<Eigen::Index>(material_.size())).array() > 0).any();
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
typename InterfaceTerm<Face>::Point InterfaceTerm<Face>::point_at(int index, const Eigen::Vector3d& x,
                                                                  const Eigen::Vector3d& X) const {
  const Sample& now = look_up(at_x_, index, x);
  const Sample& before = look_up(at_X_, index, X);
  const Eigen::Vector3d normal = before.gradient.normalized(), moved = x - X;
  const double along = normal.dot(moved);
  return {now, before, {now.gradient, moved - along * normal, now.value_mm - before.value_mm}, normal, along};
}

template <class Face>
void InterfaceTerm<Face>::add_face(int e, const State& state, const Demand& demand, Local<Face::nodes>& local) const {
  constexpr int n = Face::nodes;
  const NodeRows<n> nodes = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
  for (int p = 0; p < Face::points; ++p) {
    const int index = e * Face::points + p;
    const auto& value = Face::table().value[p];
    const Point point = point_at(index, nodes.transpose() * value, rest.transpose() * value);
    const Eigen::Vector3d& slip = point.place.slip;
    ContactMaterial<double> material = material_[index];
    material.offset_mm *= state.load;
    const double kn = material.normal, kt = material.tangential, gap = point.place.approach_mm - material.offset_mm;

    const double energy = 0.5 * kn * gap * gap + 0.5 * kt * slip.squaredNorm();
    const Eigen::Vector3d ex = contact_force(point.place, material);
    Eigen::Matrix3d exx, exX;
    if (demand.tangent || demand.reference_tangent) {
      const Eigen::Matrix3d tangential = Eigen::Matrix3d::Identity() - point.normal * point.normal.transpose();
      const Eigen::Matrix3d normal_X = tangential * point.before.hessian / point.before.gradient.norm();
      const Eigen::Matrix3d slip_X =
          -tangential - point.along * normal_X - point.normal * (slip.transpose() * normal_X);
      exx = kn * (point.now.gradient * point.now.gradient.transpose() + gap * point.now.hessian) + kt * tangential;
      exX = -kn * point.now.gradient * point.before.gradient.transpose() + kt * slip_X;
      if (material.friction > 0) {
        const Eigen::Vector3d by_push =
            -material.friction * kn * contact_pressure_slope(-kn * gap) * mobilised(slip);  // ∂/∂gap
        const Eigen::Matrix3d by_slip = material.friction * contact_pressure(-kn * gap) * mobilised_slope(slip);
        exx += by_push * point.now.gradient.transpose() + by_slip * tangential;
        exX += by_slip * slip_X - by_push * point.before.gradient.transpose();
      }
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
      const Eigen::Index row = first_point_ + index;
      if (constant({fields.interface_normal[row], fields.interface_tangential[row], fields.interface_friction[row],
                    fields.muscle_offset[row]}))
        continue;
      const auto& value = Face::table().value[p];
      const Point point = point_at(index, nodes.transpose() * value, rest.transpose() * value);
      const auto force = contact_force(point.place, contact_material(fields, row, state.load));
      const Eigen::Vector3d derivative(force[0].v[0], force[1].v[0], force[2].v[0]);
      const double area = face_point<Face>(rest, p).area;
      for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += area * value[a] * derivative;
    }
  });
}

template class InterfaceTerm<Tri3>;
template class InterfaceTerm<Tri6>;

}  // namespace supine::simulation
