// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/muscle_distance.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "meshing/anatomy/muscle_samples.h"
#include "meshing/anatomy/spline_basis.h"
#include "meshing/anatomy/spline_fit.h"

namespace supine::meshing {
namespace {

constexpr double margin_mm = 40;         // sliding past the rim is defined as far as this
constexpr double finest_knot_mm = 12;    // well above the voxel staircase, well below the chest's curvature
constexpr int most_coefficients = 5500;  // keeps the fit under a second
constexpr double sample_spacing_mm = 3, normal_smoothing_mm = 8;

// Weights of ∫‖∇∇φ‖² and ∫‖∇∇∇φ‖² against the samples. The third derivative carries the sheet's curvature past its
// rim; the second, weak as it is, lets that curvature die out over sqrt(third / second), so that noise is not blown up.
constexpr double third_weight_mm5 = 1.0e4, second_weight_mm3 = third_weight_mm5 / (120.0 * 120.0);

void check(const reconstruction::Surface& sheet) {
  double area = 0;
  for (Eigen::Index t = 0; t < sheet.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = sheet.points.row(sheet.triangles(t, 0));
    const Eigen::RowVector3d u = sheet.points.row(sheet.triangles(t, 1)) - a;
    const Eigen::RowVector3d v = sheet.points.row(sheet.triangles(t, 2)) - a;
    area += u.cross(v).norm() / 2;
  }
  if (!(area > 100))
    throw InputError(fmt::format(
        "the sheet of the muscle or support has an area of {:.3g} mm²; sliding needs at least 100 mm² (are its "
        "coordinates in mm? what is smaller can be held: kind = \"fixed\" or \"elastic\")",
        area));
}

}  // namespace

MuscleDistance::MuscleDistance(const reconstruction::Surface& sheet, const Eigen::Matrix<double, 2, 3>& reach) {
  check(sheet);
  const Eigen::RowVector3d sheet_low = sheet.points.colwise().minCoeff(),
                           sheet_high = sheet.points.colwise().maxCoeff();
  const Eigen::RowVector3d low =
      reach.row(0).cwiseMin(sheet_low.array().matrix() - Eigen::RowVector3d::Constant(margin_mm));
  const Eigen::RowVector3d high = reach.row(1).cwiseMax(sheet_high + Eigen::RowVector3d::Constant(margin_mm));
  const Eigen::Vector3d extent = (high - low).transpose();
  knot_mm_ = finest_knot_mm;
  const auto intervals = [&]() -> Eigen::Vector3i { return (extent / knot_mm_).array().ceil().max(1).cast<int>(); };
  while ((intervals().array() + 3).prod() > most_coefficients) knot_mm_ *= 1.02;
  size_ = intervals().array() + 3;
  origin_mm_ = (low + high).transpose() / 2 - (size_.array() - 3).cast<double>().matrix() * knot_mm_ / 2;

  const SheetSamples samples = sample_sheet(sheet, sample_spacing_mm, normal_smoothing_mm);
  const DistanceSamples data = offset_samples(samples, extent.norm());
  SplineFit fit(size_, knot_mm_);
  for (Eigen::Index s = 0; s < data.distance_mm.size(); ++s) {
    const Eigen::Vector3d u = (data.points.row(s).transpose() - origin_mm_) / knot_mm_;
    if ((u.array() < 0).any() || (u.array() > size_.array().cast<double>() - 3).any()) continue;
    fit.add_sample({spline_weights(u.x(), size_.x(), knot_mm_), spline_weights(u.y(), size_.y(), knot_mm_),
                    spline_weights(u.z(), size_.z(), knot_mm_)},
                   data.distance_mm[s], data.weight[s]);
  }
  fit.add_energy({0, 0, second_weight_mm3, third_weight_mm5});
  const Eigen::VectorXd solution = fit.solve();
  coefficients_.assign(solution.data(), solution.data() + solution.size());

  double squares = 0;
  for (Eigen::Index i = 0; i < samples.points.rows(); ++i) {
    const Sample at_point = at(samples.points.row(i).transpose());
    squares += samples.area_mm2[i] * std::pow(at_point.value_mm / at_point.gradient.norm(), 2);
  }
  fit_rms_mm_ = std::sqrt(squares / samples.area_mm2.sum());
}

MuscleDistance::Sample MuscleDistance::at(const Eigen::Vector3d& point_mm) const {
  const Eigen::Vector3d u = (point_mm - origin_mm_) / knot_mm_;
  const SplineWeights x = spline_weights(u.x(), size_.x(), knot_mm_);
  const SplineWeights y = spline_weights(u.y(), size_.y(), knot_mm_);
  const SplineWeights z = spline_weights(u.z(), size_.z(), knot_mm_);
  Sample s{0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d& h = s.hessian;
  for (int k = 0; k < 4; ++k) {
    double v = 0, vx = 0, vy = 0, vxx = 0, vxy = 0, vyy = 0;  // of this layer, in x and y
    for (int j = 0; j < 4; ++j) {
      const double* c = &coefficients_[x.first + size_.x() * (y.first + j + size_.y() * (z.first + k))];
      const double r = c[0] * x.value[0] + c[1] * x.value[1] + c[2] * x.value[2] + c[3] * x.value[3];
      const double rx = c[0] * x.slope[0] + c[1] * x.slope[1] + c[2] * x.slope[2] + c[3] * x.slope[3];
      const double rxx = c[0] * x.curvature[0] + c[1] * x.curvature[1] + c[2] * x.curvature[2] + c[3] * x.curvature[3];
      v += y.value[j] * r;
      vx += y.value[j] * rx;
      vxx += y.value[j] * rxx;
      vy += y.slope[j] * r;
      vxy += y.slope[j] * rx;
      vyy += y.curvature[j] * r;
    }
    s.value_mm += z.value[k] * v;
    s.gradient += Eigen::Vector3d(z.value[k] * vx, z.value[k] * vy, z.slope[k] * v);
    h(0, 0) += z.value[k] * vxx;
    h(1, 1) += z.value[k] * vyy;
    h(2, 2) += z.curvature[k] * v;
    h(1, 0) += z.value[k] * vxy;
    h(2, 0) += z.slope[k] * vx;
    h(2, 1) += z.slope[k] * vy;
  }
  h(0, 1) = h(1, 0);
  h(0, 2) = h(2, 0);
  h(1, 2) = h(2, 1);
  return s;
}

double MuscleDistance::value(const Eigen::Vector3d& point_mm) const {
  const Eigen::Vector3d u = (point_mm - origin_mm_) / knot_mm_;
  const SplineWeights x = spline_weights(u.x(), size_.x(), knot_mm_);
  const SplineWeights y = spline_weights(u.y(), size_.y(), knot_mm_);
  const SplineWeights z = spline_weights(u.z(), size_.z(), knot_mm_);
  double value = 0;
  for (int k = 0; k < 4; ++k) {
    double v = 0;
    for (int j = 0; j < 4; ++j) {
      const double* c = &coefficients_[x.first + size_.x() * (y.first + j + size_.y() * (z.first + k))];
      v += y.value[j] * (c[0] * x.value[0] + c[1] * x.value[1] + c[2] * x.value[2] + c[3] * x.value[3]);
    }
    value += z.value[k] * v;
  }
  return value;
}

}  // namespace supine::meshing
