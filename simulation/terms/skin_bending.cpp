// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_bending.h"

#include <map>
#include <utility>

#include "simulation/elements/elements.h"
#include "simulation/laws/triangle_bending.h"
#include "simulation/terms/constant.h"

namespace supine::simulation {
namespace {

// Corners of the flat triangles of a face.
constexpr std::array<std::array<int, 3>, 1> whole_face = {{{0, 1, 2}}};
constexpr std::array<std::array<int, 3>, 4> quarters = {{{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}};

template <std::size_t Parts>
TrianglePatches corners_of(const Indices& faces, const std::array<std::array<int, 3>, Parts>& parts) {
  TrianglePatches patches;
  patches.nodes.resize(faces.rows() * static_cast<Eigen::Index>(Parts), 6);
  for (int f = 0; f < faces.rows(); ++f)
    for (const auto& part : parts) {
      const auto row = static_cast<Eigen::Index>(patches.face.size());
      for (int k = 0; k < 3; ++k) patches.nodes(row, k) = patches.nodes(row, 3 + k) = faces(f, part[k]);
      patches.face.push_back(f);
    }
  patches.hinged.resize(patches.face.size(), {false, false, false});
  return patches;
}

struct Side {
  int triangle, edge;
  bool forward;  // from the edge's smaller node
};

void join(TrianglePatches& patches, const Side& side, const Side& other) {
  patches.nodes(side.triangle, 3 + side.edge) = patches.nodes(other.triangle, (other.edge + 2) % 3);
  patches.hinged[side.triangle][side.edge] = true;
}

// Places of the hinge of edge i in a patch: the edge, the triangle's own third corner, the neighbour's.
std::array<int, 4> hinge_nodes(int edge) { return {edge, (edge + 1) % 3, (edge + 2) % 3, 3 + edge}; }

/// ∂²bend/∂(patch nodes)² times @p factor, added.
void add_bend_hessian(const Hinge<double>& hinge, int edge, double factor, Eigen::Matrix<double, 18, 18>& sum) {
  const Eigen::Matrix<HingeJet, 4, 3> gradient = bend_gradient(with_derivatives(hinge));
  const auto nodes = hinge_nodes(edge);
  for (int a = 0; a < 4; ++a)
    for (int i = 0; i < 3; ++i) {
      const Eigen::Matrix<double, 12, 1> row = factor * by_nodes(gradient(a, i));
      for (int b = 0; b < 4; ++b) sum.block<1, 3>(3 * nodes[a] + i, 3 * nodes[b]) += row.segment<3>(3 * b).transpose();
    }
}

/// ∂(K Δb)/∂(corners) at fixed Δb, 3 by 9, per D.
Eigen::Matrix<double, 3, 9> stiffness_derivative(const NodeRows<6>& rest, double poisson,
                                                 const Eigen::Vector3d& change) {
  using Jet = ceres::Jet<double, 6>;
  Eigen::Matrix<Jet, 3, 1> first, second;
  for (int i = 0; i < 3; ++i) {
    first[i] = Jet(rest(1, i) - rest(0, i), i);
    second[i] = Jet(rest(2, i) - rest(0, i), 3 + i);
  }
  const Eigen::Matrix<Jet, 3, 3> stiffness = triangle_bending<Jet>(first, second, Jet(poisson));
  Eigen::Matrix<double, 3, 9> derivative;
  for (int i = 0; i < 3; ++i) {
    Jet sum(0.0);
    for (int j = 0; j < 3; ++j) sum += stiffness(i, j) * change[j];
    derivative.row(i).tail<6>() = sum.v.transpose();
    derivative.row(i).head<3>() = -(sum.v.head<3>() + sum.v.tail<3>()).transpose();
  }
  return derivative;
}

template <class T>
Eigen::Matrix<T, 3, 3> stiffness_of(const NodeRows<6>& rest, const T& poisson) {
  const Eigen::Vector3d first = (rest.row(1) - rest.row(0)).transpose(),
                        second = (rest.row(2) - rest.row(0)).transpose();
  return triangle_bending<T>(first.cast<T>(), second.cast<T>(), poisson);
}

}  // namespace

TrianglePatches triangle_patches(const Indices& faces) {
  TrianglePatches patches = faces.cols() == 6 ? corners_of(faces, quarters) : corners_of(faces, whole_face);
  std::map<std::pair<int, int>, std::vector<Side>> edges;
  for (int t = 0; t < patches.nodes.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = patches.nodes(t, k), b = patches.nodes(t, (k + 1) % 3);
      edges[std::minmax(a, b)].push_back({t, k, a < b});
    }
  for (const auto& [nodes, sides] : edges) {
    if (sides.size() != 2 || sides[0].forward == sides[1].forward) continue;
    join(patches, sides[0], sides[1]);
    join(patches, sides[1], sides[0]);
  }
  return patches;
}

SkinBendingTerm::SkinBendingTerm(TrianglePatches patches, const Pattern& pattern, bool incompressible)
    : patches_(std::move(patches)), elements_(patches_.nodes, pattern), incompressible_(incompressible) {}

template <class T>
SkinBendingTerm::Plate<T> SkinBendingTerm::plate(const Fields<T>& fields, int triangle) const {
  const int face = patches_.face[triangle];
  return {fields.skin_modulus[face] * fields.skin_bending[face], incompressible_ ? T(0.5) : fields.skin_poisson[face]};
}

void SkinBendingTerm::set_fields(const Fields<double>& fields) {
  plates_.resize(elements_.count());
  for (int t = 0; t < elements_.count(); ++t) plates_[t] = plate(fields, t);
}

Hinge<double> SkinBendingTerm::hinge(int triangle, int edge, const Points& points) const {
  const auto places = hinge_nodes(edge);
  const auto node = [&](int a) { return points.row(elements_.nodes()(triangle, places[a])); };
  const auto way = [&node](int a) { return (node(a) - node(0)).transpose(); };
  return {way(1), way(2), way(3)};
}

Eigen::Vector3d SkinBendingTerm::bends(int triangle, const Points& points) const {
  Eigen::Vector3d result = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k)
    if (patches_.hinged[triangle][k]) result[k] = bend(hinge(triangle, k, points));
  return result;
}

Eigen::Matrix<double, 18, 3> SkinBendingTerm::bend_gradients(int triangle, const Points& points) const {
  Eigen::Matrix<double, 18, 3> result = Eigen::Matrix<double, 18, 3>::Zero();
  for (int k = 0; k < 3; ++k) {
    if (!patches_.hinged[triangle][k]) continue;
    const Eigen::Matrix<double, 4, 3> gradient = bend_gradient(hinge(triangle, k, points));
    const auto nodes = hinge_nodes(k);
    for (int a = 0; a < 4; ++a) result.col(k).segment<3>(3 * nodes[a]) = gradient.row(a).transpose();
  }
  return result;
}

void SkinBendingTerm::add_triangle(int triangle, const State& state, const Demand& demand, Local<6>& local) const {
  const NodeRows<6> rest = gather<6>(state.X, elements_.nodes(), triangle);
  const auto [d, poisson] = plates_[triangle];
  const Eigen::Matrix3d stiffness = d * stiffness_of<double>(rest, poisson);
  const Eigen::Vector3d change = bends(triangle, state.x) - bends(triangle, state.X), moment = stiffness * change;
  local.energy = 0.5 * change.dot(moment);
  if (!demand.residual && !demand.tangent && !demand.reference_tangent) return;
  const Eigen::Matrix<double, 18, 3> gradient = bend_gradients(triangle, state.x);
  local.residual = gradient * moment;
  if (demand.tangent) {
    local.tangent.noalias() = gradient * stiffness * gradient.transpose();
    for (int k = 0; k < 3; ++k)
      if (patches_.hinged[triangle][k] && !demand.convex)
        add_bend_hessian(hinge(triangle, k, state.x), k, moment[k], local.tangent);
  }
  if (demand.reference_tangent) {
    Eigen::Matrix<double, 3, 18> by_rest = -stiffness * bend_gradients(triangle, state.X).transpose();
    by_rest.leftCols<9>() += d * stiffness_derivative(rest, poisson, change);
    local.reference_tangent.noalias() = gradient * by_rest;
  }
}

void SkinBendingTerm::add(const State& state, const Demand& demand, Sums& sums) const {
  add_elements<6>(elements_, demand, sums,
                  [this, &state, &demand](int t, auto& local) { add_triangle(t, state, demand, local); });
}

void SkinBendingTerm::add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const {
  add_elements<6>(elements_, Demand{.residual = true}, sums, [this, &state, &fields](int t, auto& local) {
    const auto [d, poisson] = plate(fields, t);
    if (constant({d, poisson})) return;
    const Eigen::Matrix<Dual, 3, 3> stiffness = stiffness_of<Dual>(gather<6>(state.X, elements_.nodes(), t), poisson);
    const Eigen::Vector3d change = bends(t, state.x) - bends(t, state.X);
    Eigen::Vector3d moment;
    for (int i = 0; i < 3; ++i) {
      Dual sum(0.0);
      for (int j = 0; j < 3; ++j) sum += d * stiffness(i, j) * change[j];
      moment[i] = sum.v[0];
    }
    local.residual = bend_gradients(t, state.x) * moment;
  });
}

}  // namespace supine::simulation
