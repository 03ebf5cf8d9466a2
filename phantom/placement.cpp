// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/placement.h"

#include <Eigen/Geometry>

namespace supine::phantom {
namespace {

Eigen::AngleAxisd rotation(const Eigen::Vector3d& turn_rad) {
  const double angle = turn_rad.norm();
  return {angle, angle > 0 ? Eigen::Vector3d(turn_rad / angle) : Eigen::Vector3d::UnitX()};
}

}  // namespace

Placement after(const Placement& first, const Placement& second) {
  const Eigen::AngleAxisd turn(rotation(second.turn_rad) * rotation(first.turn_rad));
  return {first.shift_mm + second.shift_mm, turn.angle() * turn.axis()};
}

void move_scan(const Placement& placement, Scan& scan) {
  const Eigen::Matrix3d turn = rotation(placement.turn_rad).toRotationMatrix();
  const Eigen::RowVector3d centre = scan.surface.points.colwise().mean();
  for (Points* points : {&scan.surface.points, &scan.landmarks.points})
    *points = ((points->rowwise() - centre) * turn.transpose()).rowwise() + (centre + placement.shift_mm.transpose());
}

}  // namespace supine::phantom
