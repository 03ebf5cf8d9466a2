// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/rigid_transform.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace supine::registration {

Points RigidTransform::apply(const Points& points) const {
  return (points * rotation.transpose()).rowwise() + shift.transpose();
}

Points RigidTransform::apply_to_directions(const Points& directions) const { return directions * rotation.transpose(); }

RigidTransform RigidTransform::inverse() const { return {rotation.transpose(), -(rotation.transpose() * shift)}; }

RigidTransform RigidTransform::then(const RigidTransform& next) const {
  return {next.rotation * rotation, next.rotation * shift + next.shift};
}

RigidTransform turned_about(const Eigen::Vector3d& pivot, const Motion& motion) {
  const Eigen::Vector3d turn = motion.tail<3>();
  const double angle = turn.norm();
  const Eigen::Matrix3d rotation = angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()
                                             : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  return {rotation, pivot - rotation * pivot + motion.head<3>()};
}

Motion motion_about(const Eigen::Vector3d& pivot, const RigidTransform& transform) {
  const Eigen::AngleAxisd turn(transform.rotation);
  Motion motion;
  motion << transform.at(pivot) - pivot, turn.angle() * turn.axis();
  return motion;
}

RigidTransform best_rigid(const Points& from, const Points& to, const Eigen::VectorXd& weights, bool mirror) {
  const double sum = weights.sum();
  const Eigen::RowVector3d from_centre = weights.transpose() * from / sum, to_centre = weights.transpose() * to / sum;
  const Eigen::Matrix3d product =
      (to.rowwise() - to_centre).transpose() * weights.asDiagonal() * (from.rowwise() - from_centre);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() * (mirror ? -1 : 1) < 0) signs.z() = -1;
  RigidTransform found;
  found.rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  found.shift = to_centre.transpose() - found.rotation * from_centre.transpose();
  return found;
}

}  // namespace supine::registration
