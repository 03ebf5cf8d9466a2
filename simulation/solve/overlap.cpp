// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/overlap.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <numeric>
#include <set>
#include <vector>

#include "simulation/terms/skin_pairs.h"

namespace supine::simulation {
namespace {

// A cell whose middle lies within so many reaches of a sample, as imaged, is the tissue under it.
constexpr double own_tissue_in_reaches = 2;
constexpr double inside = 1e-6;  // barycentric: what lies on the border of two cells lies in none

Eigen::Matrix<double, 4, 3> corners_of(const Indices& cells, int cell, const Points& shape) {
  Eigen::Matrix<double, 4, 3> corners;
  for (int a = 0; a < 4; ++a) corners.row(a) = shape.row(cells(cell, a));
  return corners;
}

bool holds(const Eigen::Matrix<double, 4, 3>& corners, const Eigen::RowVector3d& place) {
  const Eigen::Matrix3d edges = (corners.bottomRows<3>().rowwise() - corners.row(0)).transpose();
  const Eigen::Vector3d b = edges.inverse() * (place - corners.row(0)).transpose();
  return b.allFinite() && b.minCoeff() > inside && b.sum() < 1 - inside;
}

/// Samples that a cell holds which is not their own tissue, in ascending order.
std::vector<int> samples_inside(const meshing::TetMesh& mesh, const SkinSamples& samples, const SkinShape& imaged,
                                const SkinShape& now, const Points& shape) {
  std::vector<int> by_height(samples.count());
  std::iota(by_height.begin(), by_height.end(), 0);
  std::sort(by_height.begin(), by_height.end(), [&now](int a, int b) { return now.place(a, 2) < now.place(b, 2); });
  const auto below = [&now](int s, double height) { return now.place(s, 2) < height; };
  std::vector<int> found;
  for (int c = 0; c < mesh.cells.rows(); ++c) {
    const auto corners = corners_of(mesh.cells, c, shape);
    const Eigen::RowVector3d low = corners.colwise().minCoeff(), high = corners.colwise().maxCoeff();
    const Eigen::RowVector3d middle = corners_of(mesh.cells, c, mesh.points).colwise().mean();
    for (auto s = std::lower_bound(by_height.begin(), by_height.end(), low.z(), below);
         s != by_height.end() && now.place(*s, 2) <= high.z(); ++s) {
      const Eigen::RowVector3d place = now.place.row(*s);
      if ((place.array() < low.array()).any() || (place.array() > high.array()).any()) continue;
      const double near = own_tissue_in_reaches * samples.reach_mm(SkinSamples::face_of(*s));
      if ((imaged.place.row(*s) - middle).norm() < near) continue;
      if (holds(corners, place)) found.push_back(*s);
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

/// How far behind the closest skin that looks its way a sample lies, mm.
double depth_of(const SkinSamples& samples, const SkinPairs& pairs, const SkinShape& now, int sample) {
  double closest = 1e300, depth = 0;
  for (int other = 0; other < samples.count(); ++other) {
    const Eigen::RowVector3d way = now.place.row(sample) - now.place.row(other);
    if (way.squaredNorm() >= closest || now.normal.row(other).dot(now.normal.row(sample)) >= 0) continue;
    if (pairs.apart(SkinSamples::face_of(sample), SkinSamples::face_of(other))) continue;
    closest = way.squaredNorm();
    depth = -now.normal.row(other).dot(way);
  }
  return depth;
}

}  // namespace

Overlap find_overlap(const meshing::TetMesh& mesh, const Indices& skin, const Points& shape) {
  Overlap overlap;
  if (skin.rows() == 0) return overlap;
  const SkinSamples samples(skin, mesh.points);
  const SkinShape now = samples.at(shape);
  const std::vector<int> inside = samples_inside(mesh, samples, samples.at(mesh.points), now, shape);
  overlap.samples = static_cast<int>(inside.size());
  if (inside.empty()) return overlap;
  const SkinPairs pairs(samples, mesh.points);
  for (const int sample : inside) {
    const double depth = depth_of(samples, pairs, now, sample);
    if (depth <= overlap.deepest_mm) continue;
    overlap.deepest_mm = depth;
    overlap.place_mm = now.place.row(sample).transpose();
  }
  return overlap;
}

Overlap find_in_chest(const meshing::ChestBeside& chest, const Indices& skin, const Points& shape) {
  Overlap overlap;
  const std::set<int> nodes(skin.data(), skin.data() + skin.size());
  for (const int node : nodes) {
    const auto at = chest.at(shape.row(node).transpose());
    if (at.share < 1 || at.gap_mm >= 0) continue;
    ++overlap.samples;
    if (-at.gap_mm > overlap.deepest_mm)
      overlap.deepest_mm = -at.gap_mm, overlap.place_mm = shape.row(node).transpose();
  }
  return overlap;
}

std::string in_chest_warning(const std::string& name, const Overlap& overlap, const ContactSettings& settings) {
  constexpr double told_mm = 3;
  if (overlap.deepest_mm <= told_mm) return {};
  const Eigen::Vector3d& at = overlap.place_mm;
  return fmt::format(
      "{}: skin lies up to {:.1f} mm inside the chest beside the breast, at ({:.1f}, {:.1f}, {:.1f}) mm{}", name,
      overlap.deepest_mm, at.x(), at.y(), at.z(),
      settings.with_chest()
          ? ", contact notwithstanding: it lies there free of load, or contact.stiffness_kpa_per_mm is too low"
          : "; [contact] kind = \"chest\" in the model lays it on it");
}

std::string overlap_warning(const std::string& name, const Overlap& overlap, const ContactSettings& settings,
                            int folded_cells) {
  if (overlap.deepest_mm <= settings.band_mm) return {};
  const Eigen::Vector3d& at = overlap.place_mm;
  const std::string doubt =
      folded_cells > 0 ? fmt::format(" (the depth may be wrong: {} cells are folded)", folded_cells) : std::string();
  return fmt::format("{}: skin passes through skin, {:.1f} mm deep at ({:.1f}, {:.1f}, {:.1f}) mm{}{}", name,
                     overlap.deepest_mm, at.x(), at.y(), at.z(), doubt,
                     !settings.with_skin()
                         ? "; [contact] kind = \"skin\" in the model keeps skins apart"
                         : ", contact notwithstanding: pairs that were left out, or contact.stiffness_kpa_per_mm is "
                           "too low");
}

}  // namespace supine::simulation
