// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/contact_point.h"

#include <algorithm>

#include "simulation/laws/skin_contact_law.h"

namespace supine::simulation {
namespace {

constexpr double pi = 3.14159265358979323846;

/// A sample and one opposite: what the weight and the height depend on, u = (x - x_q, n_q, n), and their values.
struct Link {
  Eigen::Vector3d way, normal, own;  // x - x_q, n_q, n
  double height;                     // n_q·(x - x_q)
  double share;                      // of the whole weight, at no distance: imaged area over that of the reach
  double reach2;                     // squared
  Curve near, facing;

  Link(const SkinSamples& samples, const SkinShape& shape, int sample, int other)
      : way((shape.place.row(sample) - shape.place.row(other)).transpose()),
        normal(shape.normal.row(other).transpose()),
        own(shape.normal.row(sample).transpose()),
        height(normal.dot(way)) {
    const double reach = samples.reach_mm(SkinSamples::face_of(other));
    reach2 = reach * reach;
    share = samples.area_mm2(other) / (0.25 * pi * reach2);  // ∫ (1 - r²/R²)³ dA = π R²/4
    near = near_weight(way.squaredNorm() / reach2);
    facing = facing_weight(normal.dot(own));
  }
  double weight() const { return share * near.value * facing.value; }
};

using Nine = Eigen::Matrix<double, 9, 1>;
using NineByNine = Eigen::Matrix<double, 9, 9>;

Nine weight_gradient(const Link& link) {
  Nine g;
  g << (2 / link.reach2 * link.near.slope * link.facing.value) * link.way,
      (link.near.value * link.facing.slope) * link.own, (link.near.value * link.facing.slope) * link.normal;
  return link.share * g;
}

Nine height_gradient(const Link& link) {
  Nine g;
  g << link.normal, link.way, Eigen::Vector3d::Zero();
  return g;
}

NineByNine weight_hessian(const Link& link) {
  const double s = 2 / link.reach2;
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  NineByNine h;
  h.block<3, 3>(0, 0) =
      link.facing.value * (s * s * link.near.curvature * link.way * link.way.transpose() + s * link.near.slope * one);
  h.block<3, 3>(0, 3) = s * link.near.slope * link.facing.slope * link.way * link.own.transpose();
  h.block<3, 3>(0, 6) = s * link.near.slope * link.facing.slope * link.way * link.normal.transpose();
  h.block<3, 3>(3, 3) = link.near.value * link.facing.curvature * link.own * link.own.transpose();
  h.block<3, 3>(3, 6) =
      link.near.value * (link.facing.curvature * link.own * link.normal.transpose() + link.facing.slope * one);
  h.block<3, 3>(6, 6) = link.near.value * link.facing.curvature * link.normal * link.normal.transpose();
  for (const auto& [row, column] : {std::pair{0, 3}, std::pair{0, 6}, std::pair{3, 6}})
    h.block<3, 3>(column, row) = h.block<3, 3>(row, column).transpose();
  return link.share * h;
}

/// Places of a face's nodes in @p nodes, to which those that are new are added.
void place_nodes(const SkinSamples& samples, int face, std::vector<int>& nodes, std::vector<int>& places) {
  places.clear();
  for (int a = 0; a < samples.nodes_per_face(); ++a) {
    const int node = samples.faces()(face, a);
    const auto found = std::find(nodes.begin(), nodes.end(), node);
    places.push_back(static_cast<int>(found - nodes.begin()));
    if (found == nodes.end()) nodes.push_back(node);
  }
}

/// Sums over the links of one group, in the degrees of freedom of its nodes.
class GroupSums {
 public:
  GroupSums(const SkinSamples& samples, const Points& x, const SkinPairs::Group& group, ContactDerivatives& result)
      : samples_(samples), x_(x), sample_(group.sample), result_(result) {
    result.nodes.clear();
    place_nodes(samples, SkinSamples::face_of(sample_), result.nodes, own_places_);
    for (const int other : group.opposite) place_nodes(samples, SkinSamples::face_of(other), result.nodes, places_);
    weight_.setZero(static_cast<Eigen::Index>(3 * result.nodes.size()));
    moment_.setZero(weight_.size());
    own_normal_ = samples.normal(sample_, x);
  }

  void add(int other, const Link& link, const ContactEnergy& energy, bool exact) {
    place_nodes(samples_, SkinSamples::face_of(other), result_.nodes, places_);
    const SkinSamples::Normal normal = samples_.normal(other, x_);
    const int n = samples_.nodes_per_face();
    chain_.setZero(9, 6 * n);
    for (int a = 0; a < n; ++a) {
      chain_.block<3, 3>(0, 3 * a).diagonal().setConstant(samples_.value(sample_, a));
      chain_.block<3, 3>(0, 3 * (n + a)).diagonal().setConstant(-samples_.value(other, a));
    }
    chain_.block(3, 3 * n, 3, 3 * n) = normal.by_nodes;
    chain_.block(6, 0, 3, 3 * n) = own_normal_.by_nodes;
    const double w = link.weight();
    const Nine dw = weight_gradient(link), dh = height_gradient(link);
    const double to_weight = energy.by_weight + energy.by_moment * link.height, to_height = energy.by_moment * w;
    add_vector(chain_.transpose() * dw, weight_);
    add_vector(chain_.transpose() * (link.height * dw + w * dh), moment_);
    if (!exact) return;
    const Nine slope = to_weight * dw + to_height * dh;
    NineByNine h = to_weight * weight_hessian(link) + energy.by_moment * (dw * dh.transpose() + dh * dw.transpose());
    h.block<3, 3>(0, 3).diagonal().array() += to_height;
    h.block<3, 3>(3, 0).diagonal().array() += to_height;
    curvature_.noalias() = chain_.transpose() * (h * chain_);
    curvature_.bottomRightCorner(3 * n, 3 * n) += samples_.normal_curvature(other, normal, slope.segment<3>(3));
    curvature_.topLeftCorner(3 * n, 3 * n) += samples_.normal_curvature(sample_, own_normal_, slope.segment<3>(6));
    add_matrix();
  }

  // Once every link is in: ∇D and ∇M.
  const Eigen::VectorXd& weight() const { return weight_; }
  const Eigen::VectorXd& moment() const { return moment_; }

 private:
  int place(int a) const {
    const int n = samples_.nodes_per_face();
    return 3 * (a < n ? own_places_[a] : places_[a - n]);
  }
  void add_vector(const Eigen::VectorXd& from, Eigen::VectorXd& to) const {
    for (int a = 0; a < 2 * samples_.nodes_per_face(); ++a) to.segment<3>(place(a)) += from.segment<3>(3 * a);
  }
  void add_matrix() {
    for (int b = 0; b < 2 * samples_.nodes_per_face(); ++b)
      for (int a = 0; a < 2 * samples_.nodes_per_face(); ++a)
        result_.hessian.block<3, 3>(place(a), place(b)) += curvature_.block<3, 3>(3 * a, 3 * b);
  }

  using Chain = Eigen::Matrix<double, 9, Eigen::Dynamic, Eigen::ColMajor, 9, 6 * SkinSamples::most_nodes>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6 * SkinSamples::most_nodes,
                               6 * SkinSamples::most_nodes>;
  const SkinSamples& samples_;
  const Points& x_;
  int sample_;
  ContactDerivatives& result_;
  SkinSamples::Normal own_normal_;
  std::vector<int> own_places_, places_;
  Eigen::VectorXd weight_, moment_;
  Chain chain_;
  Square curvature_;
};

}  // namespace

ContactPoint contact_point(const SkinSamples& samples, const SkinShape& shape, const SkinPairs::Group& group) {
  ContactPoint point;
  for (const int other : group.opposite) {
    const Link link(samples, shape, group.sample, other);
    point.weight += link.weight();
    point.moment += link.weight() * link.height;
  }
  return point;
}

ContactEnergy energy_of(const ContactPoint& point, double stiffness_kpa_per_mm, double band_mm) {
  const double d = point.weight, gap = point.gap_mm();
  const Curve psi = contact_energy(gap, stiffness_kpa_per_mm, band_mm), c = coverage(d);
  const double s = c.value * psi.curvature / (d * d);
  ContactEnergy energy;
  energy.value = c.value * psi.value;
  energy.by_moment = c.value * psi.slope / d;
  energy.by_weight = c.slope * psi.value - gap * energy.by_moment;
  energy.by_moment2 = s;
  energy.by_both = (c.slope * psi.slope - energy.by_moment) / d - s * gap;
  energy.by_weight2 = c.curvature * psi.value + 2 * gap * (energy.by_moment - c.slope * psi.slope) / d + s * gap * gap;
  energy.stiffness = c.value * psi.curvature;
  return energy;
}

void differentiate(const SkinSamples& samples, const SkinShape& shape, const Points& x, const SkinPairs::Group& group,
                   const ContactPoint& point, const ContactEnergy& energy, Curvature curvature,
                   ContactDerivatives& result) {
  GroupSums sums(samples, x, group, result);
  const Eigen::Index dofs = 3 * static_cast<Eigen::Index>(result.nodes.size());
  if (curvature != Curvature::none) result.hessian.setZero(dofs, dofs);
  for (const int other : group.opposite)
    sums.add(other, Link(samples, shape, group.sample, other), energy, curvature == Curvature::exact);
  const Eigen::VectorXd &dw = sums.weight(), &dm = sums.moment();
  result.gradient = energy.by_weight * dw + energy.by_moment * dm;
  if (curvature == Curvature::convex) {
    const Eigen::VectorXd gap = (dm - point.gap_mm() * dw) / point.weight;
    result.hessian.noalias() += energy.stiffness * gap * gap.transpose();
  } else if (curvature == Curvature::exact) {
    const Eigen::VectorXd first = energy.by_weight2 * dw + energy.by_both * dm;
    const Eigen::VectorXd second = energy.by_both * dw + energy.by_moment2 * dm;
    result.hessian.noalias() += dw * first.transpose() + dm * second.transpose();
  }
}

}  // namespace supine::simulation
