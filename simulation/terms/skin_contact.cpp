// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_contact.h"

#include <algorithm>
#include <set>

#include "simulation/laws/skin_contact_law.h"

namespace supine::simulation {
namespace {

// Both skins of a pair ask each other: either counts for half.
constexpr double half = 0.5;

/// Nodes coupled by the parts, for each node.
std::vector<std::vector<int>> couplings(const std::vector<ContactDerivatives>& parts, Eigen::Index nodes) {
  std::vector<std::vector<int>> coupled(nodes);
  for (const ContactDerivatives& part : parts)
    for (const int a : part.nodes) coupled[a].insert(coupled[a].end(), part.nodes.begin(), part.nodes.end());
  return coupled;
}

}  // namespace

SkinContactTerm::SkinContactTerm(const Indices& faces, const Points& imaged, const ContactSettings& settings)
    : settings_(settings), samples_(faces, imaged), pairs_(samples_, imaged) {
  imaged_left_out_ = leave_out(samples_.at(imaged), pairs_);
}

std::vector<SkinContactTerm::Touching> SkinContactTerm::touching(const SkinPairs& pairs, const SkinShape& shape) const {
  std::vector<SkinPairs::Group> groups;
  pairs.find(shape, groups);
  std::vector<Touching> found;
  for (SkinPairs::Group& group : groups) {
    const ContactPoint point = contact_point(samples_, shape, group);
    if (coverage(point.weight).value > 0 && point.gap_mm() < settings_.band_mm)
      found.push_back({std::move(group), point});
  }
  return found;
}

LeftOut SkinContactTerm::leave_out(const SkinShape& shape, SkinPairs& pairs) const {
  LeftOut left;
  left.deepest_mm = settings_.band_mm;
  std::set<std::pair<int, int>> faces;
  for (const Touching& touch : touching(pairs, shape)) {
    const int face = SkinSamples::face_of(touch.group.sample);
    for (const int other : touch.group.opposite) faces.insert(std::minmax(face, SkinSamples::face_of(other)));
    if (touch.point.gap_mm() >= left.deepest_mm) continue;
    left.deepest_mm = touch.point.gap_mm();
    left.place_mm = shape.place.row(touch.group.sample).transpose();
  }
  left.pairs = static_cast<int>(faces.size());
  pairs.leave_out({faces.begin(), faces.end()});
  return left;
}

const SkinPairs& SkinContactTerm::pairs_of(const Points& X) const {
  if (undeformed_pairs_ == nullptr || undeformed_ != X) {
    undeformed_ = X;
    undeformed_pairs_ = std::make_unique<SkinPairs>(pairs_);
    undeformed_left_out_ = leave_out(samples_.at(X), *undeformed_pairs_);
  }
  return *undeformed_pairs_;
}

LeftOut SkinContactTerm::left_out(const Points& X) const {
  pairs_of(X);
  return undeformed_left_out_;
}

void SkinContactTerm::add(const State& state, const Demand& demand, Sums& sums) const {
  if (!demand.energy && !demand.residual && !demand.tangent) return;
  const SkinShape shape = samples_.at(state.x);
  auto touches = touching(pairs_, shape);
  if (touches.empty()) return;  // nor do those of fewer pairs
  if (const SkinPairs& pairs = pairs_of(state.X); undeformed_left_out_.pairs > 0) touches = touching(pairs, shape);
  const Curvature curvature = !demand.tangent ? Curvature::none : demand.convex ? Curvature::convex : Curvature::exact;
  std::vector<ContactDerivatives> parts(touches.size());
  std::vector<double> energies(touches.size());
#pragma omp parallel for schedule(static)
  for (std::size_t t = 0; t < touches.size(); ++t) {
    const auto& [group, point] = touches[t];
    const ContactEnergy energy = energy_of(point, settings_.stiffness_kpa_per_mm, settings_.band_mm);
    const double area = half * samples_.area_mm2(group.sample);
    energies[t] = area * energy.value;
    if (!demand.residual && !demand.tangent) continue;
    differentiate(samples_, shape, state.x, group, point, energy, curvature, parts[t]);
    parts[t].gradient *= area;
    parts[t].hessian *= area;
  }
  for (const double energy : energies) sums.energy += energy;
  if (demand.residual)
    for (const ContactDerivatives& part : parts)
      for (std::size_t a = 0; a < part.nodes.size(); ++a)
        sums.residual.segment<3>(3 * part.nodes[a]) += part.gradient.segment<3>(3 * static_cast<Eigen::Index>(a));
  if (demand.tangent) add_tangent(parts, sums);
}

void SkinContactTerm::add_tangent(const std::vector<ContactDerivatives>& parts, Sums& sums) const {
  const Pattern pattern(couplings(parts, sums.residual.size() / 3));
  sums.contact = pattern.zero_matrix();
  double* values = sums.contact.valuePtr();
  for (const ContactDerivatives& part : parts)
    for (std::size_t b = 0; b < part.nodes.size(); ++b)
      for (std::size_t a = 0; a < part.nodes.size(); ++a) {
        const int block = pattern.block(part.nodes[a], part.nodes[b]), stride = pattern.stride(part.nodes[b]);
        const auto from = part.hessian.block<3, 3>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b));
        for (int k = 0; k < 3; ++k)
          for (int i = 0; i < 3; ++i) values[block + k * stride + i] += from(i, k);
      }
}

ContactFigures SkinContactTerm::figures(const State& state) const {
  ContactFigures figures;
  const Eigen::Index faces = samples_.faces().rows();
  figures.face_kpa = Eigen::VectorXd::Zero(faces);
  Eigen::VectorXd area = Eigen::VectorXd::Zero(faces);
  for (int s = 0; s < samples_.count(); ++s) area[SkinSamples::face_of(s)] += samples_.area_mm2(s, state.x);
  const SkinShape shape = samples_.at(state.x);
  for (const auto& [group, point] : touching(pairs_of(state.X), shape)) {
    const Curve psi = contact_energy(point.gap_mm(), settings_.stiffness_kpa_per_mm, settings_.band_mm);
    const double covered = coverage(point.weight).value;
    const double force = -covered * psi.slope * samples_.area_mm2(group.sample);
    const int face = SkinSamples::face_of(group.sample);
    const double now = samples_.area_mm2(group.sample, state.x);
    figures.area_cm2 += 0.01 * covered * now;
    figures.pressure_kpa = std::max(figures.pressure_kpa, force / now);
    figures.face_kpa[face] += force / area[face];
    if (-point.gap_mm() <= figures.overlap_mm) continue;
    figures.overlap_mm = -point.gap_mm();
    figures.place_mm = shape.place.row(group.sample).transpose();
  }
  return figures;
}

double SkinContactTerm::safe_share(const Points& x, const Eigen::VectorXd& step) const {
  const Points moved = x + Eigen::Map<const Points>(step.data(), x.rows(), 3);
  const SkinShape now = samples_.at(x), then = samples_.at(moved);
  const Points way = then.place - now.place;
  const Eigen::VectorXd length = way.rowwise().norm();
  constexpr double depth_in_reaches = 0.5, aside_in_reaches = 2;
  double share = 1;
  // One sample of each face stands for it: what passes is wider than a face.
  for (int s = 0; s < samples_.count(); s += SkinSamples::per_face)
    for (int o = 0; o < samples_.count(); o += SkinSamples::per_face) {
      const int face = SkinSamples::face_of(o);
      const double reach = samples_.reach_mm(face), deep = depth_in_reaches * reach;
      const double most = length[s] + length[o];
      if (most <= deep) continue;
      const Eigen::Vector3d from = (now.place.row(s) - now.place.row(o)).transpose();
      const double height = now.normal.row(o).dot(from.transpose());
      if (height < 0 || height + deep >= share * most || from.squaredNorm() > (most + reach) * (most + reach)) continue;
      if (now.normal.row(s).dot(now.normal.row(o)) >= 0 || pairs_.apart(SkinSamples::face_of(s), face)) continue;
      const Eigen::Vector3d relative = (way.row(s) - way.row(o)).transpose();
      const double closing = -now.normal.row(o).dot(relative.transpose());
      if (share * closing <= height + deep) continue;
      const Eigen::Vector3d meet = from + height / closing * relative;
      if (meet.norm() < aside_in_reaches * reach) share = (height + deep) / closing;
    }
  return share;
}

}  // namespace supine::simulation
