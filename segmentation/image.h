// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace supine::segmentation {

/// Where the voxels of a volume lie in the patient. Patient coordinates are LPS, mm.
struct Grid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();           ///< voxels along the axes i, j, k
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();     ///< > 0
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();      ///< centre of voxel (0, 0, 0)
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  ///< orthonormal; column a = direction of axis a

  std::size_t count() const { return static_cast<std::size_t>(size.x()) * size.y() * size.z(); }
  double voxel_volume_mm3() const { return spacing_mm.prod(); }
  /// Linear index, i fastest.
  std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size.x()) * (j + static_cast<std::size_t>(size.y()) * k);
  }
  bool contains(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < size.x() && j < size.y() && k < size.z();
  }
  /// Patient coordinates of the continuous index (voxel centres have whole numbers).
  Eigen::Vector3d point(const Eigen::Vector3d& index) const {
    return origin_mm + direction * spacing_mm.cwiseProduct(index);
  }
  /// Continuous index of a patient point.
  Eigen::Vector3d continuous_index(const Eigen::Vector3d& point_mm) const {
    return (direction.transpose() * (point_mm - origin_mm)).cwiseQuotient(spacing_mm);
  }
};

/// A volume: grid and one value per voxel (Grid::index order).
template <class T>
struct Image {
  Grid grid;
  std::vector<T> voxels;  ///< size grid.count()

  T at(int i, int j, int k) const { return voxels[grid.index(i, j, k)]; }
  T& at(int i, int j, int k) { return voxels[grid.index(i, j, k)]; }
};

/// Grey values as read from a scanner or from another program's label map.
using GreyImage = Image<float>;
/// Values are those of Tissue.
using LabelImage = Image<std::uint8_t>;

}  // namespace supine::segmentation
