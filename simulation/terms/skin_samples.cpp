// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_samples.h"

#include <Eigen/Geometry>
#include <cmath>

#include "simulation/elements/elements.h"

namespace supine::simulation {
namespace {

constexpr double reach_in_edges = 0.6;  // holds about 16 samples of a mesh of equal triangles

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

SkinSamples::SkinSamples(Indices faces, const Points& imaged) : faces_(std::move(faces)), weight_(per_face) {
  const int n = nodes_per_face();
  for (auto* table : {&value_, &by_first_, &by_second_}) table->setZero(per_face, n);
  for (int p = 0; p < per_face; ++p) {
    weight_[p] = Tri6::table().weight[p];
    if (n == Tri6::nodes) {
      value_.row(p) = Tri6::table().value[p].transpose();
      by_first_.row(p) = Tri6::table().gradient[p].col(0).transpose();
      by_second_.row(p) = Tri6::table().gradient[p].col(1).transpose();
      continue;
    }
    // A corner's barycentric coordinate is its own shape function and half of those of the edges that end there.
    const auto& six = Tri6::table().value[p];
    value_.row(p) << six[0] + 0.5 * (six[3] + six[5]), six[1] + 0.5 * (six[3] + six[4]),
        six[2] + 0.5 * (six[4] + six[5]);
    by_first_.row(p) << -1, 1, 0;
    by_second_.row(p) << -1, 0, 1;
  }
  for (int s = 0; s < count(); ++s) area_mm2_.push_back(area_mm2(s, imaged));
  for (Eigen::Index f = 0; f < faces_.rows(); ++f) {
    double area = 0;
    for (int p = 0; p < per_face; ++p) area += area_mm2_[per_face * f + p];
    reach_mm_.push_back(reach_in_edges * std::sqrt(4 * area / std::sqrt(3.0)));
  }
}

Eigen::Matrix<double, 3, 2> SkinSamples::edges(int sample, const Points& x) const {
  Eigen::Matrix<double, 3, 2> e = Eigen::Matrix<double, 3, 2>::Zero();
  const int p = sample % per_face;
  for (int a = 0; a < nodes_per_face(); ++a) {
    const auto node = x.row(faces_(face_of(sample), a)).transpose();
    e.col(0) += by_first_(p, a) * node;
    e.col(1) += by_second_(p, a) * node;
  }
  return e;
}

double SkinSamples::area_mm2(int sample, const Points& x) const {
  const Eigen::Matrix<double, 3, 2> e = edges(sample, x);
  return weight_[sample % per_face] * e.col(0).cross(e.col(1)).norm();
}

SkinShape SkinSamples::at(const Points& x) const {
  SkinShape shape{Points::Zero(count(), 3), Points(count(), 3)};
  for (int s = 0; s < count(); ++s) {
    for (int a = 0; a < nodes_per_face(); ++a) shape.place.row(s) += value(s, a) * x.row(faces_(face_of(s), a));
    const Eigen::Matrix<double, 3, 2> e = edges(s, x);
    shape.normal.row(s) = e.col(0).cross(e.col(1)).normalized().transpose();
  }
  return shape;
}

SkinSamples::Normal SkinSamples::normal(int sample, const Points& x) const {
  const int n = nodes_per_face(), p = sample % per_face;
  const Eigen::Matrix<double, 3, 2> e = edges(sample, x);
  const Eigen::Matrix3d first = cross_matrix(e.col(0)), second = cross_matrix(e.col(1));
  const Eigen::Vector3d product = e.col(0).cross(e.col(1));
  Normal at{
      .by_nodes = Row(3, 3 * n), .of_product = Row(3, 3 * n), .unit = product.normalized(), .size = product.norm()};
  for (int a = 0; a < n; ++a) at.of_product.middleCols<3>(3 * a) = by_second_(p, a) * first - by_first_(p, a) * second;
  at.by_nodes = (at.of_product - at.unit * (at.unit.transpose() * at.of_product)) / at.size;
  return at;
}

SkinSamples::Block SkinSamples::normal_curvature(int sample, const Normal& at, const Eigen::Vector3d& along) const {
  const int n = nodes_per_face(), p = sample % per_face;
  const double part = at.unit.dot(along);
  const Eigen::Vector3d across = along - part * at.unit;
  const Eigen::Matrix3d by_product = -(part * (Eigen::Matrix3d::Identity() - at.unit * at.unit.transpose()) +
                                       at.unit * across.transpose() + across * at.unit.transpose()) /
                                     (at.size * at.size);
  Block curvature = at.of_product.transpose() * by_product * at.of_product;
  const Eigen::Matrix3d turn = cross_matrix(across / at.size);
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b)
      curvature.block<3, 3>(3 * a, 3 * b) -=
          (by_first_(p, a) * by_second_(p, b) - by_first_(p, b) * by_second_(p, a)) * turn;
  return curvature;
}

}  // namespace supine::simulation
