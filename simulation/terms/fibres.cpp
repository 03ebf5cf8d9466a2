// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/fibres.h"

#include "simulation/elements/tet_geometry.h"

namespace supine::simulation {
namespace {

/// The fibre through one quadrature point: y = F a, α_b = B_b·a, slack = ⟨I4 - 1⟩.
template <class Element>
struct Fibre {
  static constexpr int n = Element::nodes;
  TetPoint<Element> place;
  Eigen::Matrix3d f, turn;  // F; ∂a/∂X, 1/mm
  Eigen::Vector3d y;
  Eigen::Matrix<double, n, 1> alpha;
  double strain = 0;  // ⟨I4 - 1⟩
  const Eigen::Matrix<double, n, 1>& shape;

  Fibre(const NodeRows<n>& x, const NodeRows<n>& rest, int p, const meshing::MuscleDistance& muscle)
      : place(tet_point<Element>(rest, p)), shape(Element::table().value[p]) {
    const auto sample = muscle.at(rest.transpose() * shape);
    const double length = sample.gradient.norm();
    const Eigen::Vector3d a = sample.gradient / length;
    turn = (sample.hessian - a * (a.transpose() * sample.hessian)) / length;
    f.noalias() = x.transpose() * place.b;
    y = f * a;
    alpha = place.b * a;
    strain = std::max(0.0, y.squaredNorm() - 1);
  }

  // k V [ q α_a α_b 1 + 2 α_a α_b y yᵀ ], and with X: -(that) F + r_a B_bᵀ - r_b B_aᵀ + the turning of a.
  void add_matrices(double weight, const Demand& demand, Local<n>& local) const {
    const Eigen::Matrix3d core = weight * (strain * Eigen::Matrix3d::Identity() + 2 * y * y.transpose());
    const Eigen::Matrix3d moved = -core * f, turned = core * f * turn;
    const Eigen::Vector3d pull = weight * strain * y;
    const Eigen::Matrix<double, n, 3> steered = place.b * turn;
    for (int b = 0; b < n; ++b)
      for (int a = 0; a < n; ++a) {
        if (demand.tangent) local.tangent.template block<3, 3>(3 * a, 3 * b).noalias() += (alpha[a] * alpha[b]) * core;
        if (demand.reference_tangent)
          local.reference_tangent.template block<3, 3>(3 * a, 3 * b).noalias() +=
              (alpha[a] * alpha[b]) * moved +
              pull * (alpha[a] * place.b.row(b) - alpha[b] * place.b.row(a) + shape[b] * steered.row(a)) +
              (alpha[a] * shape[b]) * turned;
      }
  }
};

}  // namespace

template <class Element>
FibreTerm<Element>::FibreTerm(std::shared_ptr<const Elements> cells,
                              std::shared_ptr<const meshing::MuscleDistance> muscle)
    : shared_(std::move(cells)), elements_(*shared_), muscle_(std::move(muscle)) {}

template <class Element>
void FibreTerm<Element>::set_fields(const Fields<double>& fields) {
  modulus_ = fields.fibre_modulus;
  any_ = (modulus_.array() != 0).any();
}

template <class Element>
void FibreTerm<Element>::add_all(const State& state, const Eigen::VectorXd& modulus, const Demand& demand,
                                 Sums& sums) const {
  constexpr int n = Element::nodes;
  add_elements<n>(elements_, demand, sums, [&](int e, auto& local) {
    if (modulus[e] == 0) return;
    const NodeRows<n> x = gather<n>(state.x, elements_.nodes(), e), rest = gather<n>(state.X, elements_.nodes(), e);
    for (int p = 0; p < Element::points; ++p) {
      const Fibre<Element> fibre(x, rest, p, *muscle_);
      if (fibre.strain == 0) continue;
      const double weight = modulus[e] * fibre.place.volume;
      if (demand.energy) local.energy += 0.25 * weight * fibre.strain * fibre.strain;
      if (demand.residual)
        for (int a = 0; a < n; ++a)
          local.residual.template segment<3>(3 * a) += (weight * fibre.strain * fibre.alpha[a]) * fibre.y;
      if (demand.tangent || demand.reference_tangent) fibre.add_matrices(weight, demand, local);
    }
  });
}

template <class Element>
void FibreTerm<Element>::add(const State& state, const Demand& demand, Sums& sums) const {
  if (any_) add_all(state, modulus_, demand, sums);
}

template <class Element>
void FibreTerm<Element>::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  const Eigen::VectorXd slope = fields.fibre_modulus.unaryExpr([](const Dual& k) { return k.v[0]; });
  if ((slope.array() != 0).any()) add_all(state, slope, Demand{.residual = true}, sums);
}

template class FibreTerm<Tet4>;
template class FibreTerm<Tet10>;

}  // namespace supine::simulation
