// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/support_voxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "common/error.h"
#include "segmentation/tissue.h"

namespace supine::segmentation {
namespace {

/// Of the voxel's faces beyond which there is tissue.
double contact_mm2(const LabelImage& labels, int i, int j, int k) {
  double area = 0;
  for (const int step : {-1, 1})
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3i at(i, j, k);
      at[axis] += step;
      if (labels.grid.contains(at.x(), at.y(), at.z()) &&
          is_meshed(static_cast<Tissue>(labels.at(at.x(), at.y(), at.z()))))
        area += labels.grid.spacing_mm.prod() / labels.grid.spacing_mm[axis];
    }
  return area;
}

struct Count {
  std::size_t voxels = 0;
  Eigen::Vector3i first = Eigen::Vector3i::Zero();
  double contact_mm2 = 0;
};

std::vector<Count> count(const SupportVoxels& supports, const LabelImage& labels) {
  const Grid& grid = labels.grid;
  std::vector<Count> counts(supports.names.size());
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::uint8_t number = supports.number[grid.index(i, j, k)];
        if (number == 0) continue;
        Count& of = counts[number - 1U];
        if (of.voxels++ == 0) of.first = {i, j, k};
        of.contact_mm2 += contact_mm2(labels, i, j, k);
      }
  return counts;
}

/// Nearest support within a box of voxels around @p centre; −1 where there is none.
int nearest_in_box(const SupportVoxels& supports, const Grid& grid, const Eigen::Vector3d& index,
                   const Eigen::Vector3i& centre, int half, double& least_mm) {
  int best = -1;
  least_mm = std::numeric_limits<double>::infinity();
  const Eigen::Vector3i low = (centre.array() - half).max(0), high = (centre.array() + half).min(grid.size.array() - 1);
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) {
        const std::uint8_t number = supports.number[grid.index(i, j, k)];
        if (number == 0) continue;
        const double mm = grid.spacing_mm.cwiseProduct(Eigen::Vector3d(i, j, k) - index).norm();
        if (mm < least_mm) least_mm = mm, best = number - 1;
      }
  return best;
}

}  // namespace

SupportVoxels mark_supports(const GreyImage& values, const std::vector<LabelSupport>& supports) {
  SupportVoxels marked;
  if (supports.empty()) return marked;
  marked.number.assign(values.voxels.size(), 0);
  for (const LabelSupport& support : supports) {
    marked.names.push_back(support.name);
    const auto number = static_cast<std::uint8_t>(marked.names.size());
    for (const int value : support.values)
      for (std::size_t n = 0; n < values.voxels.size(); ++n)
        if (values.voxels[n] == static_cast<float>(value)) marked.number[n] = number;
  }
  return marked;
}

void check_supports(const SupportVoxels& supports, const LabelImage& labels, const std::string& file) {
  if (supports.names.empty()) return;
  const std::vector<Count> counts = count(supports, labels);
  for (std::size_t s = 0; s < counts.size(); ++s) {
    if (counts[s].voxels == 0)
      throw InputError(
          fmt::format("{}: support '{}' of [image.labels] has no voxel; correct its values, or take it out", file,
                      supports.names[s]));
    if (counts[s].contact_mm2 >= smallest_contact_mm2) continue;
    const Eigen::Vector3d at = labels.grid.point(counts[s].first.cast<double>());
    if (counts[s].contact_mm2 > 0)
      throw InputError(
          fmt::format("{}: support '{}' ({} voxels, first at ({:.1f}, {:.1f}, {:.1f}) mm) touches tissue on {:.3g} mm2 "
                      "only; less than {:g} mm2 is noise of the labels. Label more of it, or list its values under air",
                      file, supports.names[s], counts[s].voxels, at.x(), at.y(), at.z(), counts[s].contact_mm2,
                      smallest_contact_mm2));
    throw InputError(
        fmt::format("{}: support '{}' holds nothing: none of its {} voxels (first at ({:.1f}, {:.1f}, {:.1f}) mm) "
                    "borders on tissue through a face; label what touches the body, or list its values under air",
                    file, supports.names[s], counts[s].voxels, at.x(), at.y(), at.z()));
  }
}

int nearest_support(const SupportVoxels& supports, const Grid& grid, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d index = grid.continuous_index(point_mm);
  const Eigen::Vector3i centre = index.array().round().max(0).min(grid.size.cast<double>().array() - 1).cast<int>();
  const double outside = (centre.cast<double>() - index).cwiseAbs().maxCoeff();
  for (int half = 2;; half *= 2) {
    double least_mm = 0;
    const int best = nearest_in_box(supports, grid, index, centre, half, least_mm);
    // Every voxel nearer than this to the point lies in the box.
    const bool all = least_mm <= (half - outside) * grid.spacing_mm.minCoeff();
    if (best >= 0 && (all || half >= grid.size.maxCoeff())) return best;
    if (half >= grid.size.maxCoeff()) throw InputError("the labels hold no voxel of a support");
  }
}

}  // namespace supine::segmentation
