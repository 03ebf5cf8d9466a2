// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshing/jacobian.h"
#include "meshing/topology.h"
#include "segmentation/tissue.h"

namespace supine::meshing {
namespace {

using CornerPoints = Eigen::Matrix<double, 4, 3>;

// Outward normals of the four faces, length twice the area; row i opposite to corner i.
CornerPoints face_normals(const CornerPoints& x) {
  CornerPoints normals;
  for (int i = 0; i < 4; ++i) {
    const auto& f = tet_faces[i];
    const Eigen::RowVector3d u = x.row(f[1]) - x.row(f[0]), v = x.row(f[2]) - x.row(f[0]);
    normals.row(i) = u.cross(v);
  }
  return normals;
}

double volume(const CornerPoints& x) {
  const Eigen::RowVector3d u = x.row(1) - x.row(0), v = x.row(2) - x.row(0), w = x.row(3) - x.row(0);
  return u.cross(v).dot(w) / 6;
}

}  // namespace

std::pair<double, double> dihedral_range_deg(const CornerPoints& corners) {
  if (!(volume(corners) > 0)) return {0, 180};
  const CornerPoints normals = face_normals(corners).rowwise().normalized();
  double low = 180, high = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      const double angle =
          180 - std::acos(std::clamp(normals.row(i).dot(normals.row(j)), -1.0, 1.0)) * 180 / std::numbers::pi;
      low = std::min(low, angle);
      high = std::max(high, angle);
    }
  }
  return {low, high};
}

double shape_angle_deg(const CornerPoints& corners) {
  const auto [low, high] = dihedral_range_deg(corners);
  return std::min(low, 1.2 * (180 - high));
}

double radius_ratio(const CornerPoints& corners) {
  const double v = volume(corners);
  const double area = face_normals(corners).rowwise().norm().sum() / 2;
  // Circumradius from the products of opposite edges: 24 V R = sqrt(s (s-2p)(s-2q)(s-2r)), s = p + q + r (Crelle).
  const auto edge = [&](int a, int b) { return (corners.row(a) - corners.row(b)).norm(); };
  const double p = edge(0, 1) * edge(2, 3), q = edge(0, 2) * edge(1, 3), r = edge(0, 3) * edge(1, 2);
  const double root = std::sqrt(std::max(0.0, (p + q + r) * (p + q - r) * (p - q + r) * (q + r - p)));
  if (!(root > 0) || !(area > 0)) return 0;
  return 3 * (3 * v / area) * (24 * v) / root * (v < 0 ? -1 : 1);
}

namespace {

// @return the curved volume
double measure_curved(const TetMesh& mesh, Eigen::Index c, QualityReport& report) {
  const QuadraticNodes nodes = quadratic_nodes(mesh, c);
  const double jacobian = smallest_scaled_jacobian(nodes).low;
  report.mean_scaled_jacobian += (jacobian - 1) / static_cast<double>(mesh.cells.rows());
  ++report.scaled_jacobian[std::clamp(static_cast<int>(jacobian * 10), 0, 9)];
  if (report.worst_jacobian_cell < 0 || jacobian < report.min_scaled_jacobian) {
    report.worst_jacobian_cell = static_cast<int>(c);
    report.min_scaled_jacobian = jacobian;
    report.worst_jacobian_place_mm =
        Eigen::RowVector3d(mesh.points(mesh.cells.row(c).head(4), Eigen::all).colwise().mean()).transpose();
  }
  if (!(jacobian > 0)) ++report.inverted;
  return curved_volume_mm3(nodes);
}

}  // namespace

QualityReport measure_quality(const TetMesh& mesh) {
  QualityReport report;
  report.nodes = mesh.points.rows();
  report.cells = mesh.cells.rows();
  report.faces = mesh.faces.rows();
  report.min_radius_ratio = 2;
  report.tissue_ml = Eigen::VectorXd::Zero(segmentation::tissue_count);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    CornerPoints x;
    for (int k = 0; k < 4; ++k) x.row(k) = mesh.points.row(mesh.cells(c, k));
    const double straight = volume(x), ratio = radius_ratio(x);
    const auto [low, high] = dihedral_range_deg(x);
    double v = straight;
    if (!(straight > 0))
      ++report.inverted;
    else if (mesh.order() == 2)
      v = measure_curved(mesh, c, report);
    if (report.smallest_angle_cell < 0 || low < report.min_dihedral_deg) {
      report.min_dihedral_deg = low;
      report.smallest_angle_cell = static_cast<int>(c);
      report.smallest_angle_place_mm = x.colwise().mean().transpose();
    }
    report.max_dihedral_deg = std::max(report.max_dihedral_deg, high);
    ++report.smallest_dihedral[std::min(17, static_cast<int>(low / 10))];
    ++report.largest_dihedral[std::min(17, static_cast<int>(high / 10))];
    ++report.radius_ratio[std::clamp(static_cast<int>(ratio * 10), 0, 9)];
    report.mean_radius_ratio += ratio / static_cast<double>(report.cells);
    if (ratio < report.min_radius_ratio) {
      report.min_radius_ratio = ratio;
      report.worst_cell = static_cast<int>(c);
      report.worst_place_mm = x.colwise().mean().transpose();
    }
    report.volume_ml += v / 1000;
    if (mesh.fraction.rows() == mesh.cells.rows()) report.tissue_ml += v / 1000 * mesh.fraction.row(c).transpose();
  }
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    report.area_cm2[mesh.region[f]] +=
        (mesh.order() == 2 ? curved_area_mm2 : face_area_mm2)(mesh.points, mesh.faces, f) / 100;
    ++report.region_faces[mesh.region[f]];
  }
  return report;
}

}  // namespace supine::meshing
