// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/coarse.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/statistics.h"
#include "registration/observations.h"

namespace supine::registration {
namespace {

constexpr int search_points = 120, search_iterations = 20, polish_iterations = 20;
constexpr std::size_t most_placements = 4;

Eigen::RowVector3d centre_of_body(const Problem& problem) {
  if (problem.target.skin) {
    // Points of the mesh off the skin are in the table as well.
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (const int node : problem.target.skin->triangles().reshaped()) sum += problem.target.skin->points().row(node);
    return sum / static_cast<double>(problem.target.skin->triangles().size());
  }
  return problem.target.rigid->points().colwise().mean();
}

Points body_points(const Problem& problem) {
  if (!problem.target.skin) return problem.target.rigid->points();
  const std::vector<int> nodes(problem.target.skin->triangles().data(),
                               problem.target.skin->triangles().data() + problem.target.skin->triangles().size());
  return problem.target.skin->points()(nodes, Eigen::all);
}

/// Columns: principal directions, the longest first; right-handed.
Eigen::Matrix3d principal_directions(const Points& points) {
  const Points centred = points.rowwise() - points.colwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(Eigen::Matrix3d(centred.transpose() * centred));
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  if (axes.determinant() < 0) axes.col(2) *= -1;
  return axes;
}

double score(const Problem& problem, const std::vector<int>& rows, const RigidTransform& placement) {
  return match_score_mm(match(problem, rows, placement));
}

bool nearly_the_same(const Problem& problem, const RigidTransform& a, const RigidTransform& b) {
  constexpr double apart_mm = 2;
  return (a.apply(problem.points) - b.apply(problem.points)).rowwise().norm().maxCoeff() < apart_mm;
}

/// Each start refined with few points, the best of what differs with more.
std::vector<Placement> refined(const Problem& problem, const std::vector<RigidTransform>& starts) {
  const std::vector<int> few = drawn_rows(problem.points.rows(), search_points),
                         more = drawn_rows(problem.points.rows(), 4 * search_points);
  std::vector<Placement> found(starts.size());
#pragma omp parallel for schedule(dynamic)
  for (std::size_t s = 0; s < starts.size(); ++s) {
    found[s].transform = icp(problem, few, starts[s], search_iterations);
    found[s].score_mm = score(problem, few, found[s].transform);
  }
  const auto better = [](const Placement& a, const Placement& b) { return a.score_mm < b.score_mm; };
  std::stable_sort(found.begin(), found.end(), better);
  std::vector<Placement> kept;
  for (const Placement& candidate : found) {
    if (kept.size() == most_placements) break;
    const RigidTransform polished = icp(problem, more, candidate.transform, polish_iterations);
    if (std::none_of(kept.begin(), kept.end(),
                     [&](const Placement& k) { return nearly_the_same(problem, k.transform, polished); }))
      kept.push_back({polished, score(problem, more, polished)});
  }
  std::stable_sort(kept.begin(), kept.end(), better);
  return kept;
}

RigidTransform centred(const RigidTransform& turn, const Problem& problem) {
  RigidTransform moved = turn;
  moved.shift += centre_of_body(problem).transpose() - moved.at(problem.points.colwise().mean().transpose());
  return moved;
}

}  // namespace

RigidTransform icp(const Problem& problem, const std::vector<int>& rows, const RigidTransform& start, int iterations) {
  constexpr double widest_mm = 80, narrowest_mm = 3, medians = 4;
  RigidTransform placement = start;
  Gate gate{widest_mm, true};
  for (int i = 0; i < iterations; ++i) {
    const Eigen::Vector3d pivot = placement.apply(problem.points(rows, Eigen::all)).colwise().mean();
    const Observations seen = observe(problem, rows, placement, pivot, 0, gate);
    if (seen.residual.size() < unknowns) return placement;
    const Eigen::MatrixXd jacobian = seen.jacobian.leftCols<6>();
    const Eigen::VectorXd weight = seen.noise_mm.array().max(1).square().inverse();
    Eigen::Matrix<double, 6, 6> normal = jacobian.transpose() * weight.asDiagonal() * jacobian;
    // Where the shape fixes nothing, no step is taken.
    normal.diagonal().head<3>().array() += 1e-3 * weight.sum();
    normal.diagonal().tail<3>().array() += 1.0 * weight.sum();
    const Motion step = normal.ldlt().solve(-jacobian.transpose() * weight.asDiagonal() * seen.residual);
    placement = placement.then(turned_about(pivot, step));
    gate.with_border = i < iterations / 2;
    gate.reach_mm = std::clamp(medians * median(seen.residual.cwiseAbs()), narrowest_mm, widest_mm);
    if (step.head<3>().norm() < 1e-4 && step.tail<3>().norm() < 1e-6 && !gate.with_border) break;
  }
  return placement;
}

RigidTransform start_of(const Problem& problem) {
  const auto count = static_cast<Eigen::Index>(problem.landmarks.size());
  if (count == 0) return {};
  Points scan(count, 3), image(count, 3);
  Eigen::VectorXd weight(count);
  for (Eigen::Index l = 0; l < count; ++l) {
    const Landmark& landmark = problem.landmarks[static_cast<std::size_t>(l)];
    scan.row(l) = landmark.scan;
    image.row(l) = landmark.image;
    weight[l] = 1 / (landmark.sigma_mm * landmark.sigma_mm);
  }
  if (count >= 3) return best_rigid(scan, image, weight);
  RigidTransform shifted;
  shifted.shift = (weight.transpose() * (image - scan)).transpose() / weight.sum();
  return shifted;
}

std::vector<Placement> search_near(const Problem& problem, const RigidTransform& start) {
  const double step = 15 * std::acos(-1.0) / 180;
  const Eigen::Vector3d pivot = start.apply(problem.points).colwise().mean();
  std::vector<RigidTransform> starts = {start};
  for (int code = 0; code < 27; ++code) {
    Motion motion = Motion::Zero();
    motion.tail<3>() = step * Eigen::Vector3d(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
    starts.push_back(start.then(turned_about(pivot, motion)));
    starts.push_back(centred(starts.back(), problem));
  }
  return refined(problem, starts);
}

std::vector<Placement> search_far(const Problem& problem) {
  const Eigen::Matrix3d scan = principal_directions(problem.points), body = principal_directions(body_points(problem));
  std::vector<RigidTransform> starts;
  for (const Eigen::Matrix3d& change : axis_changes(false)) {
    starts.push_back({change, Eigen::Vector3d::Zero()});
    starts.push_back(centred({change, Eigen::Vector3d::Zero()}, problem));
    starts.push_back(centred({body * change * scan.transpose(), Eigen::Vector3d::Zero()}, problem));
  }
  return refined(problem, starts);
}

std::vector<Eigen::Matrix3d> axis_changes(bool mirror) {
  std::vector<Eigen::Matrix3d> changes;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) change(row, order[row]) = signs >> row & 1 ? -1 : 1;
      if ((change.determinant() < 0) == mirror) changes.push_back(change);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return changes;
}

}  // namespace supine::registration
