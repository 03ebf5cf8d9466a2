// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/scan_motion.h"

#include <ceres/rotation.h>

#include <Eigen/Geometry>

namespace supine::calibration {

ScanMotion::ScanMotion(const Eigen::VectorXd& motion, const Points& scan)
    : shift_(motion.head<3>()),
      centroid_(scan.colwise().mean().transpose()),
      rotation_(Eigen::Matrix3d::Identity()),
      none_(motion.isZero(0)) {
  const Eigen::Vector3d turn = motion.tail<3>();
  if (const double angle = turn.norm(); angle > 0) rotation_ = Eigen::AngleAxisd(angle, turn / angle);
}

Points ScanMotion::corrected(const Points& given) const {
  if (none_) return given;
  const Eigen::RowVector3d centre = centroid_.transpose(), back = (centroid_ - shift_).transpose();
  return ((given.rowwise() - centre) * rotation_).rowwise() + back;  // rows: (Rᵀ v)ᵀ = vᵀ R
}

Points ScanMotion::as_given(const Points& corrected) const {
  if (none_) return corrected;
  const Eigen::RowVector3d centre = centroid_.transpose(), back = (centroid_ - shift_).transpose();
  return ((corrected.rowwise() - back) * rotation_.transpose()).rowwise() + centre;
}

Points ScanMotion::directions_as_given(const Points& directions) const {
  if (none_) return directions;
  return directions * rotation_.transpose();
}

Points corrected_derivative(const simulation::Fields<simulation::Dual>::Column& motion, const Points& scan,
                            const Points& points) {
  using simulation::Dual;
  const Eigen::RowVector3d centre = scan.colwise().mean();
  const Dual back[3] = {-motion[3], -motion[4], -motion[5]};
  Points derivative(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::RowVector3d arm = points.row(i) - centre;
    const Dual from[3] = {Dual(arm[0]), Dual(arm[1]), Dual(arm[2])};
    Dual to[3];
    ceres::AngleAxisRotatePoint(back, from, to);
    for (int k = 0; k < 3; ++k) derivative(i, k) = to[k].v[0] - motion[k].v[0];
  }
  return derivative;
}

}  // namespace supine::calibration
