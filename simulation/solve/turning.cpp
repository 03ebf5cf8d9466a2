// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/turning.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace supine::simulation {
namespace {

constexpr double first_step_deg = 30, least_step_deg = 2, longest_step_deg = 45;
constexpr int easy_iterations = 8;  // a step solved in so many: the next one is longer
constexpr double detour_from_deg = 135;
constexpr double deg = std::numbers::pi / 180;

double between_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / deg;
}

/// On the great circle from a to b.
Eigen::Vector3d turned(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double by_deg) {
  const Eigen::Vector3d across = b - a.dot(b) * a;
  if (!(across.norm() > 0)) return a;
  return std::cos(by_deg * deg) * a + std::sin(by_deg * deg) * across.normalized();
}

}  // namespace

bool Turn::detour() const { return between_deg(from, to) > detour_from_deg; }

double Turn::angle_deg() const {
  return detour() ? between_deg(from, over) + between_deg(over, to) : between_deg(from, to);
}

Eigen::Vector3d Turn::gravity_at(double at_deg) const {
  if (at_deg >= angle_deg()) return to;
  if (!detour()) return turned(from, to, at_deg);
  const double half = between_deg(from, over);
  return at_deg < half ? turned(from, over, at_deg) : turned(over, to, at_deg - half);
}

Turn turn_of(const meshing::Anatomy& anatomy, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = anatomy.side == "both" ? Eigen::Vector3d(-anatomy.head) : anatomy.lateral;
  return {from, to, (way - way.dot(from) * from).normalized()};
}

namespace {

std::optional<SolveReport> follow(EquilibriumSolver& solver, const Turn& turn,
                                  const std::function<void(const Eigen::Vector3d& gravity)>& load, const Points& X,
                                  Points& x, const std::string& what) {
  SolveReport whole;
  whole.turned = true;
  const double end = turn.angle_deg();
  double at = 0, step = first_step_deg;
  Points trial;
  while (at < end) {
    const double target = std::min(end, at + step);
    load(turn.gravity_at(target));
    trial = x;
    const std::optional<SolveReport> report = solver.forward_from(X, trial, what);
    if (report) {
      x.swap(trial);
      at = target;
      whole.newton_iterations += report->newton_iterations;
      whole.factorisations += report->factorisations;
      whole.min_det_f = report->min_det_f;
      whole.residual_share = report->residual_share;
      whole.termination = report->termination;
      ++whole.load_steps;
      if (report->newton_iterations <= easy_iterations) step = std::min(2 * step, longest_step_deg);
    } else {
      step = 0.5 * (target - at);
      if (step < least_step_deg) return std::nullopt;
    }
  }
  return whole;
}

}  // namespace

std::optional<SolveReport> turn_over(EquilibriumSolver& solver, const Turn& turn,
                                     const std::function<void(const Eigen::Vector3d& gravity)>& load, const Points& X,
                                     Points& x, const std::string& what, int most_work) {
  solver.limit_work(most_work);
  const std::optional<SolveReport> report = follow(solver, turn, load, X, x, what);
  solver.limit_work({});
  return report;
}

}  // namespace supine::simulation
