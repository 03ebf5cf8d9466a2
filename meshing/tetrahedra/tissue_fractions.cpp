// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/tissue_fractions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "meshing/topology.h"
#include "segmentation/tissue.h"

namespace supine::meshing {
namespace {

using segmentation::Grid;
using segmentation::LabelImage;
using segmentation::Tissue;

constexpr int divisions = 7;    // of a tetrahedron's edges: 84 points
constexpr int near_voxels = 3;  // the surface stays this close to the voxels it came from
constexpr int far_voxels = 10;
constexpr double most_outside = 0.05;
constexpr std::ptrdiff_t none = -1;

bool meshed(int tissue) { return segmentation::is_meshed(static_cast<Tissue>(tissue)); }

// Voxel steps within `radius` voxels (of the finest axis), nearest first in mm.
std::vector<Eigen::Vector3i> steps_by_distance(const Grid& grid, int radius) {
  const double reach_mm = radius * grid.spacing_mm.minCoeff();
  const Eigen::Vector3i n = (reach_mm / grid.spacing_mm.array()).ceil().cast<int>();
  std::vector<Eigen::Vector3i> steps;
  for (int k = -n.z(); k <= n.z(); ++k) {
    for (int j = -n.y(); j <= n.y(); ++j) {
      for (int i = -n.x(); i <= n.x(); ++i) steps.emplace_back(i, j, k);
    }
  }
  const auto distance = [&](const Eigen::Vector3i& s) {
    return s.cast<double>().cwiseProduct(grid.spacing_mm).squaredNorm();
  };
  std::stable_sort(steps.begin(), steps.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return steps;
}

class TissueAt {
 public:
  explicit TissueAt(const LabelImage& labels)
      : labels_(labels),
        near_(steps_by_distance(labels.grid, near_voxels)),
        far_(steps_by_distance(labels.grid, far_voxels)) {}

  /// The meshed voxel next to a point, as an index; none without one.
  std::ptrdiff_t near(const Eigen::Vector3d& p) const { return search(p, near_); }
  std::ptrdiff_t far(const Eigen::Vector3d& p) const { return search(p, far_); }

 private:
  std::ptrdiff_t search(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3i>& steps) const {
    const Eigen::Vector3d index = labels_.grid.continuous_index(p);
    if (!(index.array().abs() < 1e6).all()) return none;
    const Eigen::Vector3i home = index.array().round().cast<int>();
    for (const Eigen::Vector3i& step : steps) {
      const Eigen::Vector3i v = home + step;
      if (!labels_.grid.contains(v.x(), v.y(), v.z())) continue;
      const std::size_t n = labels_.grid.index(v.x(), v.y(), v.z());
      if (meshed(labels_.voxels[n])) return static_cast<std::ptrdiff_t>(n);
    }
    return none;
  }

  const LabelImage& labels_;
  std::vector<Eigen::Vector3i> near_, far_;
};

void check_fit(const TetMesh& mesh, const std::vector<double>& outside, FractionReport& report) {
  double volume = 0, missed = 0;
  Eigen::RowVector3d place = Eigen::RowVector3d::Zero();
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const double v = cell_volume_mm3(mesh.points, mesh.cells, c);
    volume += v;
    missed += v * outside[c];
    place += v * outside[c] * mesh.points.row(mesh.cells(c, 0));
  }
  report.outside_share = missed / volume;
  if (report.outside_share <= most_outside) return;
  place /= missed;
  throw InputError(fmt::format(
      "{:.1f} % of the mesh's volume (around ({:.1f}, {:.1f}, {:.1f}) mm) lies where the labels have no tissue "
      "that is meshed; at most {:.0f} % may: are surface and labels of the same case and in the same frame?",
      100 * report.outside_share, place.x(), place.y(), place.z(), 100 * most_outside));
}

/// Volume and middle of a body.
struct Bulk {
  double mm3 = 0;
  Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
  void add(double volume_mm3, const Eigen::RowVector3d& place) {
    mm3 += volume_mm3;
    middle += volume_mm3 / mm3 * (place - middle);
  }
};

/// What is meshed of the labels around the mesh: elsewhere there may be another breast.
Bulk bulk_of_labels(const TetMesh& mesh, const LabelImage& labels) {
  constexpr double around_mm = 10;
  const Eigen::RowVector3d low = mesh.points.colwise().minCoeff().array() - around_mm,
                           high = mesh.points.colwise().maxCoeff().array() + around_mm;
  const segmentation::Grid& grid = labels.grid;
  Bulk bulk;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        if (!meshed(labels.voxels[grid.index(i, j, k)])) continue;
        const Eigen::RowVector3d place = grid.point(Eigen::Vector3d(i, j, k)).transpose();
        if ((place.array() >= low.array()).all() && (place.array() <= high.array()).all())
          bulk.add(grid.voxel_volume_mm3(), place);
      }
  return bulk;
}

/// Refuses labels of another body, another place or another size that the mesh happens to lie in.
void check_bulk(const TetMesh& mesh, const LabelImage& labels) {
  constexpr double factor = 1.25, farthest_mm = 5;
  Bulk body;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    body.add(cell_volume_mm3(mesh.points, mesh.cells, c),
             mesh.points(mesh.cells.row(c).head(4), Eigen::all).colwise().mean());
  const Bulk tissue = bulk_of_labels(mesh, labels);
  const std::string question = "are surface and labels of the same case, from one run?";
  if (tissue.mm3 > factor * body.mm3 || body.mm3 > factor * tissue.mm3)
    throw InputError(
        fmt::format("the labels hold {:.0f} ml of tissue where the mesh lies, which holds {:.0f} ml "
                    "(bound: a factor of {}): {}",
                    tissue.mm3 / 1000, body.mm3 / 1000, factor, question));
  const Eigen::RowVector3d off = tissue.middle - body.middle;
  if (off.norm() > farthest_mm)
    throw InputError(
        fmt::format("the middle of the labels' tissue lies ({:.1f}, {:.1f}, {:.1f}) mm from that of the "
                    "mesh (bound {} mm): {}",
                    off.x(), off.y(), off.z(), farthest_mm, question));
}

/// Adds a voxel to the tissues it holds. @param gland_share  of a voxel of fat or gland; NaN = by the label alone
void count_voxel(int tissue, float gland_share, std::array<double, segmentation::tissue_count>& hits) {
  const bool mixed = tissue == static_cast<int>(Tissue::adipose) || tissue == static_cast<int>(Tissue::gland);
  if (!mixed || std::isnan(gland_share)) {
    hits[tissue] += 1;
    return;
  }
  hits[static_cast<int>(Tissue::gland)] += gland_share;
  hits[static_cast<int>(Tissue::adipose)] += 1 - gland_share;
}

}  // namespace

const std::vector<Eigen::RowVector4d>& cell_samples() {
  static const std::vector<Eigen::RowVector4d> samples = [] {
    std::vector<Eigen::RowVector4d> points;
    for (int i = 0; i < divisions; ++i) {
      for (int j = 0; i + j < divisions; ++j) {
        for (int k = 0; i + j + k < divisions; ++k) {
          const int l = divisions - 1 - i - j - k;
          points.push_back((Eigen::RowVector4d(i, j, k, l).array() + 0.25) / divisions);
        }
      }
    }
    return points;
  }();
  return samples;
}

FractionReport assign_tissue(TetMesh& mesh, const LabelImage& labels, std::span<const float> gland_share) {
  const TissueAt tissue_at(labels);
  const std::vector<Eigen::RowVector4d>& samples = cell_samples();
  const Eigen::Index count = mesh.cells.rows();
  mesh.fraction = Table::Zero(count, segmentation::tissue_count);
  mesh.tissue.resize(count);
  std::vector<double> outside(count, 0.0);
#pragma omp parallel for schedule(static)
  for (Eigen::Index c = 0; c < count; ++c) {
    Eigen::Matrix<double, 4, 3> corners;
    for (int k = 0; k < 4; ++k) corners.row(k) = mesh.points.row(mesh.cells(c, k));
    std::array<double, segmentation::tissue_count> hits{};
    int all = 0;
    for (const Eigen::RowVector4d& sample : samples) {
      const std::ptrdiff_t voxel = tissue_at.near((sample * corners).transpose());
      if (voxel == none) continue;
      count_voxel(labels.voxels[voxel], gland_share.empty() ? NAN : gland_share[voxel], hits);
      ++all;
    }
    outside[c] = 1 - static_cast<double>(all) / static_cast<double>(samples.size());
    if (all == 0) {
      const std::ptrdiff_t voxel = tissue_at.far(corners.colwise().mean().transpose());
      hits[voxel == none ? static_cast<int>(Tissue::adipose) : labels.voxels[voxel]] = all = 1;
    }
    for (int t = 0; t < segmentation::tissue_count; ++t) mesh.fraction(c, t) = hits[t] / all;
    mesh.tissue[c] = static_cast<int>(std::max_element(hits.begin(), hits.end()) - hits.begin());
  }
  FractionReport report;
  check_fit(mesh, outside, report);
  check_bulk(mesh, labels);
  std::array<double, segmentation::tissue_count> voxels{};
  for (std::size_t v = 0; v < labels.voxels.size(); ++v)
    if (meshed(labels.voxels[v])) count_voxel(labels.voxels[v], gland_share.empty() ? NAN : gland_share[v], voxels);
  report.voxel_ml = Eigen::Map<const Eigen::VectorXd>(voxels.data(), segmentation::tissue_count) *
                    (labels.grid.voxel_volume_mm3() / 1000);
  return report;
}

}  // namespace supine::meshing
