// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/part_fractions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "common/error.h"
#include "meshing/tetrahedra/tissue_fractions.h"
#include "meshing/topology.h"
#include "segmentation/tissue.h"

namespace supine::meshing {
namespace {

constexpr double most_overlap = 1e-3;  // of the body's volume: planes and facets meet no better

/// Share of a tetrahedron where a linear function with these corner values is positive.
double positive_share(std::array<double, 4> value) {
  std::sort(value.begin(), value.end(), std::greater<>());
  const auto cut = [&value](int from, int to) { return value[from] / (value[from] - value[to]); };
  if (value[3] >= 0) return 1;
  if (value[0] <= 0) return 0;
  if (value[1] <= 0) return cut(0, 1) * cut(0, 2) * cut(0, 3);
  if (value[2] > 0) return 1 - cut(3, 0) * cut(3, 1) * cut(3, 2);
  // A wedge: two corners on each side. Its three tetrahedra, as shares of the whole.
  const double s02 = cut(0, 2), s03 = cut(0, 3), s12 = cut(1, 2), s13 = cut(1, 3);
  return s02 * s03 + (1 - s02) * s03 * s12 + (1 - s03) * s12 * s13;
}

double share_of(const TetMesh& mesh, Eigen::Index c, const BodyPlace& part) {
  if (!part.surface) {
    std::array<double, 4> height{};
    for (int k = 0; k < 4; ++k)
      height[k] = (mesh.points.row(mesh.cells(c, k)).transpose() - part.point).dot(part.normal);
    return positive_share(height);
  }
  Eigen::Matrix<double, 4, 3> corners;
  for (int k = 0; k < 4; ++k) corners.row(k) = mesh.points.row(mesh.cells(c, k));
  const auto& samples = cell_samples();
  int inside = 0;
  for (const Eigen::RowVector4d& sample : samples) inside += lies_in_part(part, (sample * corners).transpose()) ? 1 : 0;
  return static_cast<double>(inside) / static_cast<double>(samples.size());
}

void refuse_overlap(const TetMesh& mesh, const std::vector<BodyPlace>& parts, Eigen::Index worst, double share) {
  std::string names;
  for (std::size_t p = 0; p < parts.size(); ++p)
    if (mesh.part_fraction(worst, static_cast<Eigen::Index>(p)) > 0)
      names += (names.empty() ? "'" : " and '") + parts[p].name + "'";
  Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
  for (int k = 0; k < 4; ++k) at += mesh.points.row(mesh.cells(worst, k)) / 4;
  throw InputError(
      fmt::format("parts {} overlap: {:.2g} % of the body lies in more than one (bound {:g} %), most around ({:.1f}, "
                  "{:.1f}, {:.1f}) "
                  "mm. Each place belongs to one part; change the planes or surfaces of [image.parts]",
                  names, 100 * share, 100 * most_overlap, at.x(), at.y(), at.z()));
}

}  // namespace

void assign_parts(TetMesh& mesh, const std::vector<BodyPlace>& parts) {
  const Eigen::Index cells = mesh.cells.rows();
  if (mesh.fraction.rows() != cells) {
    mesh.tissue = Eigen::VectorXi::Constant(cells, static_cast<int>(segmentation::Tissue::adipose));
    mesh.fraction = Table::Zero(cells, segmentation::tissue_count);
    mesh.fraction.col(static_cast<int>(segmentation::Tissue::adipose)).setOnes();
  }
  mesh.part_fraction.resize(cells, static_cast<Eigen::Index>(parts.size()));
#pragma omp parallel for schedule(static)
  for (Eigen::Index c = 0; c < cells; ++c)
    for (std::size_t p = 0; p < parts.size(); ++p)
      mesh.part_fraction(c, static_cast<Eigen::Index>(p)) = share_of(mesh, c, parts[p]);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    mesh.part_names.push_back(parts[p].name);
    if (mesh.part_fraction.col(static_cast<Eigen::Index>(p)).sum() == 0)
      throw InputError(
          fmt::format("part '{}' holds nothing of the body; is its plane or surface in the body's frame and "
                      "unit (mm), and does its normal point into the part?",
                      parts[p].name));
  }
  double volume = 0, doubled = 0;
  Eigen::Index worst = 0;
  for (Eigen::Index c = 0; c < cells; ++c) {
    const double v = cell_volume_mm3(mesh.points, mesh.cells, c);
    volume += v;
    doubled += v * std::max(0.0, mesh.part_fraction.row(c).sum() - 1);
    if (mesh.part_fraction.row(c).sum() > mesh.part_fraction.row(worst).sum()) worst = c;
  }
  if (doubled > most_overlap * volume) refuse_overlap(mesh, parts, worst, doubled / volume);
}

void assign_supports(TetMesh& mesh, const std::vector<BodyPlace>& supports) {
  for (const BodyPlace& support : supports) mesh.support_names.push_back(support.name);
  mesh.muscle_support.resize(mesh.muscle.triangles.rows());
  for (Eigen::Index t = 0; t < mesh.muscle_support.size(); ++t) {
    const Eigen::Vector3d a = mesh.muscle.points.row(mesh.muscle.triangles(t, 0)),
                          b = mesh.muscle.points.row(mesh.muscle.triangles(t, 1)),
                          c = mesh.muscle.points.row(mesh.muscle.triangles(t, 2));
    // The sheet's triangles face the body.
    const int support = support_of_face(supports, (a + b + c) / 3, (c - a).cross(b - a).normalized());
    if (support < 0)
      throw InputError(
          fmt::format("the sheet's triangle at ({:.1f}, {:.1f}, {:.1f}) mm lies on none of the case's "
                      "supports; make the surfaces again from this case",
                      a.x(), a.y(), a.z()));
    mesh.muscle_support[t] = support;
  }
}

void assign_supports(TetMesh& mesh, const segmentation::SupportVoxels& supports, const segmentation::Grid& grid) {
  mesh.support_names = supports.names;
  mesh.muscle_support.resize(mesh.muscle.triangles.rows());
#pragma omp parallel for schedule(static)
  for (Eigen::Index t = 0; t < mesh.muscle_support.size(); ++t) {
    const Eigen::RowVector3d centre = mesh.muscle.points(mesh.muscle.triangles.row(t), Eigen::all).colwise().mean();
    mesh.muscle_support[t] = segmentation::nearest_support(supports, grid, centre.transpose());
  }
}

}  // namespace supine::meshing
