// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/match.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace supine::registration {
namespace {

constexpr double least_cosine = 0.5;

Points displacement_at(const calibration::ClosestPoints& closest, const Points& displacement) {
  Points found = Points::Zero(closest.point.rows(), 3);
  if (displacement.rows() == 0) return found;
  for (Eigen::Index q = 0; q < found.rows(); ++q)
    for (int corner = 0; corner < 3; ++corner)
      found.row(q) += closest.weight(q, corner) * displacement.row(closest.node(q, corner));
  return found;
}

void take(Matches& to, Eigen::Index q, const calibration::ClosestPoints& from, bool rigid) {
  to.point.row(q) = from.point.row(q);
  to.normal.row(q) = from.normal.row(q);
  to.distance_mm[q] = from.distance_mm[q];
  to.border[q] = from.on_border[q];
  to.rigid[q] = rigid;
  if (rigid) to.displacement.row(q).setZero();
}

}  // namespace

Matches match(const Problem& problem, const std::vector<int>& rows, const RigidTransform& placement) {
  const Points points = placement.apply(problem.points(rows, Eigen::all));
  const Points normals = placement.apply_to_directions(problem.normals(rows, Eigen::all));
  const Eigen::Index count = points.rows();
  Matches found{Points(count, 3), Points(count, 3), Points::Zero(count, 3), Eigen::VectorXd(count), {}, {}, {}};
  for (auto* flags : {&found.border, &found.facing, &found.rigid}) flags->resize(count);
  calibration::ClosestPoints closest;
  if (problem.target.skin) {
    problem.target.skin->closest(points, closest);
    found.displacement = displacement_at(closest, problem.target.skin_displacement);
    for (Eigen::Index q = 0; q < count; ++q) take(found, q, closest, false);
  }
  if (problem.target.rigid) {
    problem.target.rigid->closest(points, closest);
    for (Eigen::Index q = 0; q < count; ++q)
      if (!problem.target.skin || closest.distance_mm[q] < found.distance_mm[q]) take(found, q, closest, true);
  }
  for (Eigen::Index q = 0; q < count; ++q)
    found.facing[q] = normals.row(q).isZero() || std::abs(normals.row(q).dot(found.normal.row(q))) >= least_cosine;
  return found;
}

double match_score_mm(const Matches& matches) {
  double sum = 0;
  for (Eigen::Index q = 0; q < matches.distance_mm.size(); ++q) {
    const double distance = matches.facing[q] ? std::min(lost_mm, matches.distance_mm[q]) : lost_mm;
    sum += distance * distance;
  }
  return std::sqrt(sum / std::max<Eigen::Index>(1, matches.distance_mm.size()));
}

double overlap(const Matches& matches) {
  int meeting = 0;
  for (Eigen::Index q = 0; q < matches.distance_mm.size(); ++q)
    meeting += matches.facing[q] && matches.distance_mm[q] < (matches.border[q] ? at_border_mm : lost_mm);
  return static_cast<double>(meeting) / std::max<Eigen::Index>(1, matches.distance_mm.size());
}

std::vector<int> drawn_rows(Eigen::Index of, int count) {
  std::vector<int> rows(of);
  std::iota(rows.begin(), rows.end(), 0);
  std::mt19937 random(1);
  const std::size_t kept = std::min<std::size_t>(count, rows.size());
  for (std::size_t i = 0; i < kept; ++i) std::swap(rows[i], rows[i + random() % (rows.size() - i)]);
  rows.resize(kept);
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace supine::registration
