// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/elements/elements.h"

namespace supine::simulation {
namespace {

// Barycentric coordinates are b = (1 - Σξ, ξ), so ∂b/∂ξ is constant.
template <int D>
Eigen::Matrix<double, D + 1, D> barycentric_gradient() {
  Eigen::Matrix<double, D + 1, D> g;
  g.row(0).setConstant(-1);
  g.template bottomRows<D>().setIdentity();
  return g;
}

constexpr std::array<std::array<int, 2>, 6> tet_edges = {{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<std::array<int, 2>, 3> triangle_edges = {{{0, 1}, {1, 2}, {2, 0}}};

// Value and ∂/∂b of the quadratic simplex: corners b(2b - 1), mid-edges 4 b_i b_j.
template <int D, int E>
void quadratic_simplex(const Eigen::Matrix<double, D + 1, 1>& b, const std::array<std::array<int, 2>, E>& edges,
                       Eigen::Matrix<double, D + 1 + E, 1>& value,
                       Eigen::Matrix<double, D + 1 + E, D + 1>& derivative) {
  derivative.setZero();
  for (int a = 0; a <= D; ++a) {
    value[a] = b[a] * (2 * b[a] - 1);
    derivative(a, a) = 4 * b[a] - 1;
  }
  for (int e = 0; e < E; ++e) {
    const auto [i, j] = edges[e];
    value[D + 1 + e] = 4 * b[i] * b[j];
    derivative(D + 1 + e, i) = 4 * b[j];
    derivative(D + 1 + e, j) = 4 * b[i];
  }
}

ShapeTable<4, 3, 1> make_tet4() {
  ShapeTable<4, 3, 1> t;
  t.value[0].setConstant(0.25);
  t.gradient[0] = barycentric_gradient<3>();
  t.weight[0] = 1.0 / 6;
  return t;
}

ShapeTable<10, 3, 4> make_tet10() {
  ShapeTable<10, 3, 4> t;
  const double near = 0.58541019662496845446, far = 0.13819660112501051518;  // (5 + 3√5) / 20, (5 - √5) / 20
  for (int p = 0; p < 4; ++p) {
    Eigen::Vector4d b = Eigen::Vector4d::Constant(far);
    b[p] = near;
    Eigen::Matrix<double, 10, 4> derivative;
    quadratic_simplex<3, 6>(b, tet_edges, t.value[p], derivative);
    t.gradient[p] = derivative * barycentric_gradient<3>();
    t.weight[p] = 1.0 / 24;
  }
  return t;
}

ShapeTable<3, 2, 3> make_tri3() {
  ShapeTable<3, 2, 3> t;
  for (int p = 0; p < 3; ++p) {
    t.value[p].setConstant(1.0 / 6);
    t.value[p][p] = 2.0 / 3;
    t.gradient[p] = barycentric_gradient<2>();
    t.weight[p] = 1.0 / 6;
  }
  return t;
}

ShapeTable<6, 2, 6> make_tri6() {
  ShapeTable<6, 2, 6> t;
  // Dunavant 1985, table of degree 4: two orbits of three points, the coordinate that differs and the weight of each.
  const std::array<double, 2> corner = {0.108103018168070, 0.816847572980459};
  const std::array<double, 2> share = {0.223381589678011, 0.109951743655322};
  for (int p = 0; p < 6; ++p) {
    const int orbit = p / 3;
    Eigen::Vector3d b = Eigen::Vector3d::Constant((1 - corner[orbit]) / 2);
    b[p % 3] = corner[orbit];
    Eigen::Matrix<double, 6, 3> derivative;
    quadratic_simplex<2, 3>(b, triangle_edges, t.value[p], derivative);
    t.gradient[p] = derivative * barycentric_gradient<2>();
    t.weight[p] = share[orbit] / 2;
  }
  return t;
}

}  // namespace

const ShapeTable<4, 3, 1>& Tet4::table() {
  static const auto t = make_tet4();
  return t;
}
const ShapeTable<10, 3, 4>& Tet10::table() {
  static const auto t = make_tet10();
  return t;
}
const ShapeTable<3, 2, 3>& Tri3::table() {
  static const auto t = make_tri3();
  return t;
}
const ShapeTable<6, 2, 6>& Tri6::table() {
  static const auto t = make_tri6();
  return t;
}

const std::array<Eigen::Matrix<double, 10, 3>, 4>& tet10_corner_gradients() {
  static const auto gradients = [] {
    std::array<Eigen::Matrix<double, 10, 3>, 4> all;
    for (int corner = 0; corner < 4; ++corner) {
      Eigen::Matrix<double, 10, 1> value;
      Eigen::Matrix<double, 10, 4> derivative;
      quadratic_simplex<3, 6>(Eigen::Vector4d::Unit(corner), tet_edges, value, derivative);
      all[corner] = derivative * barycentric_gradient<3>();
    }
    return all;
  }();
  return gradients;
}

Eigen::Matrix<double, 10, 1> tet10_shape(const Eigen::Vector4d& b) {
  Eigen::Matrix<double, 10, 1> value;
  Eigen::Matrix<double, 10, 4> derivative;
  quadratic_simplex<3, 6>(b, tet_edges, value, derivative);
  return value;
}

}  // namespace supine::simulation
