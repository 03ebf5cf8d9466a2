// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/observations.h"

#include <Eigen/Geometry>

namespace supine::registration {
namespace {

class Writer {
 public:
  Writer(Observations& to, Eigen::Index most) : to_(to) {
    to.jacobian.resize(most, unknowns);
    to.residual.resize(most);
    to.noise_mm.resize(most);
    to.place.resize(most, 3);
    to.direction.resize(most, 3);
  }

  void add(const Eigen::Vector3d& arm, const Eigen::Vector3d& place, const Eigen::Vector3d& along,
           const Eigen::Vector3d& displacement, double residual, double noise_mm, bool rigid) {
    to_.jacobian.row(row_) << along.transpose(), arm.cross(along).transpose(), -along.dot(displacement);
    to_.residual[row_] = residual;
    to_.noise_mm[row_] = noise_mm;
    to_.place.row(row_) = place;
    to_.direction.row(row_) = along;
    to_.rigid.push_back(rigid);
    ++row_;
  }

  void finish() {
    to_.jacobian.conservativeResize(row_, Eigen::NoChange);
    to_.residual.conservativeResize(row_);
    to_.noise_mm.conservativeResize(row_);
    to_.place.conservativeResize(row_, Eigen::NoChange);
    to_.direction.conservativeResize(row_, Eigen::NoChange);
  }

 private:
  Observations& to_;
  Eigen::Index row_ = 0;
};

}  // namespace

Observations observe(const Problem& problem, const std::vector<int>& rows, const RigidTransform& placement,
                     const Eigen::Vector3d& pivot, double softness, const Gate& gate) {
  Observations found;
  Writer writer(found, static_cast<Eigen::Index>(rows.size() + 3 * problem.landmarks.size()));
  if (problem.target.skin || problem.target.rigid) {
    const Matches matches = match(problem, rows, placement);
    for (std::size_t q = 0; q < rows.size(); ++q) {
      const auto at = static_cast<Eigen::Index>(q);
      const Eigen::Vector3d point = placement.at(problem.points.row(rows[q]).transpose()), body = matches.point.row(at),
                            displacement = matches.displacement.row(at);
      const bool border = matches.border[q];
      if (matches.distance_mm[at] > gate.reach_mm || (border ? !gate.with_border : !matches.facing[q])) continue;
      const Eigen::Vector3d off = point - body, along = border && off.norm() > 0
                                                            ? Eigen::Vector3d(off.normalized())
                                                            : Eigen::Vector3d(matches.normal.row(at));
      writer.add(point - pivot, body, along, displacement, along.dot(off), problem.noise_mm, matches.rigid[q]);
    }
  }
  for (const Landmark& landmark : problem.landmarks) {
    const Eigen::Vector3d point = placement.at(landmark.scan),
                          off = point - landmark.image - softness * landmark.displacement;
    for (int axis = 0; axis < 3; ++axis)
      writer.add(point - pivot, landmark.image, Eigen::Vector3d::Unit(axis), landmark.displacement, off[axis],
                 landmark.sigma_mm, landmark.rigid);
  }
  writer.finish();
  return found;
}

}  // namespace supine::registration
