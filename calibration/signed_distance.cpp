// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/signed_distance.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "common/error.h"

namespace supine::calibration {
namespace {

constexpr double touching_mm = 1e-9;

void check(const CoverageBounds& bounds, const Points& points, const Points& normals) {
  if (!(bounds.distance_mm > 0)) {
    throw InputError(fmt::format("coverage distance {} mm; it must be > 0", bounds.distance_mm));
  }
  if (!(bounds.angle_deg > 0 && bounds.angle_deg <= 90)) {
    throw InputError(fmt::format("coverage angle {} deg; it must lie in (0, 90]", bounds.angle_deg));
  }
  if (points.rows() != normals.rows()) {
    throw InputError(fmt::format("{} model points but {} normals", points.rows(), normals.rows()));
  }
}

// Cosine between the model's normal and the scan's at the closest point.
double cosine(const Scan& scan, const ClosestPoints& closest, Eigen::Index i, const Eigen::Vector3d& model_normal) {
  const Points& normals = scan.distance().normals();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) normal += closest.weight(i, k) * normals.row(closest.node(i, k)).transpose();
  const double cosine = normal.normalized().dot(model_normal);
  return scan.distance().is_cloud() ? std::abs(cosine) : cosine;
}

}  // namespace

void scan_to_model(const ModelSkin& model, const Points& scan_points, SignedDistances& result) {
  model.closest(scan_points, result.closest);
  const ClosestPoints& closest = result.closest;
  result.distance_mm.resize(scan_points.rows());
  for (Eigen::Index i = 0; i < scan_points.rows(); ++i) {
    const double side = (scan_points.row(i) - closest.point.row(i)).dot(closest.normal.row(i));
    result.distance_mm[i] = side < 0 ? -closest.distance_mm[i] : closest.distance_mm[i];
  }
}

Points direction(const Points& scan_points, const SignedDistances& distances) {
  Points unit(scan_points.rows(), 3);
  for (Eigen::Index i = 0; i < scan_points.rows(); ++i) {
    const double d = distances.distance_mm[i];
    if (std::abs(d) < touching_mm) {
      unit.row(i) = distances.closest.normal.row(i);
    } else {
      unit.row(i) = (scan_points.row(i) - distances.closest.point.row(i)) / d;
    }
  }
  return unit;
}

void model_to_scan(const Scan& scan, const Points& points, const Points& normals, const CoverageBounds& bounds,
                   ModelToScan& result) {
  check(bounds, points, normals);
  ClosestPoints& closest = result.to_scan.closest;
  scan.distance().closest(points, closest);
  result.to_scan.distance_mm.resize(points.rows());
  result.covered.resize(points.rows());
  const double least_cosine = std::cos(bounds.angle_deg * std::numbers::pi / 180);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const double side = (closest.point.row(i) - points.row(i)).dot(normals.row(i));
    const double distance_mm = closest.distance_mm[i];
    result.to_scan.distance_mm[i] = side < 0 ? -distance_mm : distance_mm;
    result.covered[i] = !closest.on_border[i] && distance_mm < bounds.distance_mm &&
                        cosine(scan, closest, i, normals.row(i)) >= least_cosine;
  }
}

}  // namespace supine::calibration
