// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/chest_contact.h"

#include "simulation/elements/surface_geometry.h"
#include "simulation/laws/skin_contact_law.h"

namespace supine::simulation {
namespace {

struct Density {
  double energy = 0;  // kPa mm
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
};

/// Of share × ψ(gap). @param convex  without what the curvature of the chest and its border add
Density density(const meshing::ChestBeside::Sample& at, const ContactSettings& settings, bool convex) {
  const Curve psi = contact_energy(at.gap_mm, settings.stiffness_kpa_per_mm, settings.band_mm);
  Density d;
  d.energy = at.share * psi.value;
  d.gradient = psi.value * at.share_gradient + at.share * psi.slope * at.gradient;
  d.hessian = at.share * psi.curvature * at.gradient * at.gradient.transpose();
  if (convex) return d;
  const Eigen::Matrix3d crossed = psi.slope * at.share_gradient * at.gradient.transpose();
  d.hessian += psi.value * at.share_hessian + crossed + crossed.transpose() + at.share * psi.slope * at.hessian;
  return d;
}

template <class Face>
double area_at(const NodeRows<Face::nodes>& nodes, int p) {
  const Eigen::Matrix<double, 3, 2> tangent = nodes.transpose() * Face::table().gradient[p];
  return Face::table().weight[p] * tangent.col(0).cross(tangent.col(1)).norm();
}

}  // namespace

template <class Face>
ChestContactTerm<Face>::ChestContactTerm(const Indices& faces, const Pattern& pattern, const Points& imaged,
                                         meshing::ChestBeside chest, const ContactSettings& settings)
    : elements_(faces, pattern),
      chest_(std::move(chest)),
      settings_(settings),
      area_mm2_(faces.rows() * Face::points),
      imaged_acts_(static_cast<std::size_t>(faces.rows()) * Face::points, 1) {
  for (int e = 0; e < faces.rows(); ++e)
    for (int p = 0; p < Face::points; ++p)
      area_mm2_[e * Face::points + p] = area_at<Face>(gather<Face::nodes>(imaged, elements_.nodes(), e), p);
  imaged_left_out_ = leave_out(imaged, imaged_acts_);
}

template <class Face>
LeftOut ChestContactTerm<Face>::leave_out(const Points& shape, std::vector<char>& acts) const {
  LeftOut left;
  left.deepest_mm = settings_.band_mm;
  for (int e = 0; e < elements_.count(); ++e) {
    const auto nodes = gather<Face::nodes>(shape, elements_.nodes(), e);
    bool any = false;
    for (int p = 0; p < Face::points; ++p) {
      char& act = acts[static_cast<std::size_t>(e) * Face::points + p];
      if (!act) continue;
      const Eigen::Vector3d place = nodes.transpose() * Face::table().value[p];
      const auto at = chest_.at(place);
      if (!(at.share > 0) || !(at.gap_mm < settings_.band_mm)) continue;
      act = 0, any = true;
      if (at.gap_mm < left.deepest_mm) left.deepest_mm = at.gap_mm, left.place_mm = place;
    }
    left.pairs += any;
  }
  return left;
}

template <class Face>
const std::vector<char>& ChestContactTerm<Face>::acts_from(const Points& X) const {
  if (undeformed_.rows() != X.rows() || undeformed_ != X) {
    undeformed_ = X;
    undeformed_acts_ = imaged_acts_;
    undeformed_left_out_ = leave_out(X, undeformed_acts_);
  }
  return undeformed_acts_;
}

template <class Face>
LeftOut ChestContactTerm<Face>::left_out(const Points& X) const {
  acts_from(X);
  return undeformed_left_out_;
}

template <class Face>
void ChestContactTerm<Face>::add_face(int e, const State& state, const std::vector<char>& acts, const Demand& demand,
                                      Local<Face::nodes>& local) const {
  constexpr int n = Face::nodes;
  const NodeRows<n> nodes = gather<n>(state.x, elements_.nodes(), e);
  for (int p = 0; p < Face::points; ++p) {
    const int point = e * Face::points + p;
    if (!acts[static_cast<std::size_t>(point)]) continue;
    const auto& value = Face::table().value[p];
    const auto at = chest_.at(nodes.transpose() * value);
    if (!(at.share > 0) || !(at.gap_mm < settings_.band_mm)) continue;
    const Density d = density(at, settings_, demand.convex);
    const double area = area_mm2_[point];
    local.energy += area * d.energy;
    for (int a = 0; a < n; ++a) local.residual.template segment<3>(3 * a) += area * value[a] * d.gradient;
    if (!demand.tangent) continue;
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b)
        local.tangent.template block<3, 3>(3 * a, 3 * b) += area * value[a] * value[b] * d.hessian;
  }
}

template <class Face>
void ChestContactTerm<Face>::add(const State& state, const Demand& demand, Sums& sums) const {
  if (!demand.energy && !demand.residual && !demand.tangent) return;
  const std::vector<char>& acts = acts_from(state.X);
  Demand own = demand;
  own.reference_tangent = false;
  add_elements<Face::nodes>(elements_, own, sums, [&](int e, auto& local) { add_face(e, state, acts, own, local); });
}

template <class Face>
ContactFigures ChestContactTerm<Face>::figures(const State& state) const {
  ContactFigures figures;
  figures.face_kpa = Eigen::VectorXd::Zero(elements_.count());
  const std::vector<char>& acts = acts_from(state.X);
  for (int e = 0; e < elements_.count(); ++e) {
    const auto nodes = gather<Face::nodes>(state.x, elements_.nodes(), e);
    double force = 0, area = 0;
    for (int p = 0; p < Face::points; ++p) {
      const double now = area_at<Face>(nodes, p);
      area += now;
      const int point = e * Face::points + p;
      if (!acts[static_cast<std::size_t>(point)]) continue;
      const Eigen::Vector3d place = nodes.transpose() * Face::table().value[p];
      const auto at = chest_.at(place);
      if (!(at.share > 0) || !(at.gap_mm < settings_.band_mm)) continue;
      const double push = -at.share *
                          contact_energy(at.gap_mm, settings_.stiffness_kpa_per_mm, settings_.band_mm).slope *
                          area_mm2_[point];
      force += push;
      figures.area_cm2 += 0.01 * at.share * now;
      figures.pressure_kpa = std::max(figures.pressure_kpa, push / now);
      if (at.share == 1 && -at.gap_mm > figures.overlap_mm) figures.overlap_mm = -at.gap_mm, figures.place_mm = place;
    }
    figures.face_kpa[e] = force / area;
  }
  return figures;
}

template class ChestContactTerm<Tri3>;
template class ChestContactTerm<Tri6>;

}  // namespace supine::simulation
