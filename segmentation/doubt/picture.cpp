// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>

#include "segmentation/doubt/doubt.h"

namespace supine::segmentation {
namespace {

constexpr double around_mm = 60;

struct Box {
  Eigen::Vector3i low, size;
};

/// What lies around a place, one voxel thick along the image axis nearest to a patient axis.
Box around(const Grid& grid, const Eigen::Vector3d& place_mm, int patient_axis) {
  const Eigen::Vector3i at =
      grid.continuous_index(place_mm).array().round().cast<int>().max(0).min(grid.size.array() - 1);
  Eigen::Index thin = 0;
  grid.direction.row(patient_axis).cwiseAbs().maxCoeff(&thin);
  Box box;
  for (int a = 0; a < 3; ++a) {
    const int reach = a == thin ? 0 : static_cast<int>(around_mm / grid.spacing_mm[a]);
    box.low[a] = std::max(0, at[a] - reach);
    box.size[a] = std::min(grid.size[a] - 1, at[a] + reach) - box.low[a] + 1;
  }
  return box;
}

template <class T>
Image<T> cropped(const Image<T>& image, const Box& box) {
  Image<T> part{image.grid, {}};
  part.grid.size = box.size;
  part.grid.origin_mm = image.grid.point(box.low.cast<double>());
  part.voxels.reserve(part.grid.count());
  for (int k = 0; k < box.size.z(); ++k)
    for (int j = 0; j < box.size.y(); ++j)
      for (int i = 0; i < box.size.x(); ++i)
        part.voxels.push_back(image.at(box.low.x() + i, box.low.y() + j, box.low.z() + k));
  return part;
}

}  // namespace

std::array<Picture, 3> pictures_of(const Doubt& doubt, const LabelImage& labels, const GreyImage& image) {
  std::array<Picture, 3> pictures;
  constexpr std::array<int, 3> axes{2, 0, 1};
  for (int n = 0; n < 3; ++n) {
    const Box box = around(labels.grid, doubt.place_mm, axes[n]);
    const GreyImage grey = cropped(image, box);
    std::vector<double> places;
    pictures[n] = overlay(cropped(labels, box), &grey, axes[n], {.slices = 1, .columns = 1}, places);
  }
  return pictures;
}

}  // namespace supine::segmentation
