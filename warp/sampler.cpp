// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/sampler.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace supine::warp {
namespace {

using segmentation::Grid;

/// Coefficients of the cubic B-spline through the values of one line, in place: a causal and an anticausal filter with
/// the pole √3 − 2, ends mirrored on the outermost voxel.
void filter_line(std::vector<double>& line) {
  const auto n = static_cast<int>(line.size());
  if (n == 1) return;
  const double pole = std::sqrt(3.0) - 2;
  const double gain = (1 - pole) * (1 - 1 / pole);
  for (double& value : line) value *= gain;
  // Beyond 30 voxels the pole's power is under 1e-17.
  const int horizon = std::min(n, 30);
  double first = line[0], power = pole;
  for (int i = 1; i < horizon; ++i, power *= pole) first += power * line[static_cast<std::size_t>(i)];
  line[0] = first;
  for (std::size_t i = 1; i < line.size(); ++i) line[i] += pole * line[i - 1];
  line.back() = pole / (pole * pole - 1) * (line.back() + pole * line[line.size() - 2]);
  for (std::size_t i = line.size() - 1; i-- > 0;) line[i] = pole * (line[i + 1] - line[i]);
}

void filter_axis(std::vector<float>& values, const Grid& grid, int axis) {
  const std::array<std::size_t, 3> stride = {1, static_cast<std::size_t>(grid.size.x()),
                                             static_cast<std::size_t>(grid.size.x()) * grid.size.y()};
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
#pragma omp parallel
  {
    std::vector<double> line(static_cast<std::size_t>(grid.size[axis]));
#pragma omp for
    for (int b = 0; b < grid.size[v]; ++b)
      for (int a = 0; a < grid.size[u]; ++a) {
        float* start =
            values.data() + a * stride[static_cast<std::size_t>(u)] + b * stride[static_cast<std::size_t>(v)];
        const std::size_t step = stride[static_cast<std::size_t>(axis)];
        for (std::size_t i = 0; i < line.size(); ++i) line[i] = start[i * step];
        filter_line(line);
        for (std::size_t i = 0; i < line.size(); ++i) start[i * step] = static_cast<float>(line[i]);
      }
  }
}

/// Weights of the four coefficients from floor(x) − 1 on.
std::array<double, 4> cubic_weights(double t) {
  const double s = 1 - t;
  return {s * s * s / 6, 2.0 / 3 - 0.5 * t * t * (2 - t), 2.0 / 3 - 0.5 * s * s * (2 - s), t * t * t / 6};
}

int mirrored(int i, int n) {
  if (n == 1) return 0;
  if (i < 0) i = -i;
  return i < n ? i : 2 * (n - 1) - i;
}

}  // namespace

Sampler::Sampler(const segmentation::GreyImage& volume, Interpolation interpolation)
    : volume_(volume), interpolation_(interpolation) {
  if (interpolation != Interpolation::bspline) return;
  coefficients_ = volume.voxels;
  for (int axis = 0; axis < 3; ++axis) filter_axis(coefficients_, volume.grid, axis);
}

std::optional<float> Sampler::at(const Eigen::Vector3d& index) const {
  const Eigen::Vector3d last = (volume_.grid.size.array() - 1).matrix().cast<double>();
  if ((index.array() < -0.5).any() || ((index - last).array() > 0.5).any()) return std::nullopt;
  const Eigen::Vector3d inside = index.cwiseMax(0).cwiseMin(last);
  switch (interpolation_) {
    case Interpolation::nearest:
      return nearest(inside);
    case Interpolation::linear:
      return linear(inside);
    default:
      return cubic(inside);
  }
}

float Sampler::nearest(const Eigen::Vector3d& index) const {
  const Eigen::Vector3i i = index.array().round().cast<int>();
  return volume_.at(i.x(), i.y(), i.z());
}

float Sampler::linear(const Eigen::Vector3d& index) const {
  const Grid& grid = volume_.grid;
  const Eigen::Vector3i i = index.array().floor().cast<int>();
  const Eigen::Vector3i next = (i.array() + 1).min(grid.size.array() - 1);
  const Eigen::Vector3f t = (index - i.cast<double>()).cast<float>();
  const auto along = [&](int j, int k) {
    const float a = volume_.at(i.x(), j, k);
    return a + t.x() * (volume_.at(next.x(), j, k) - a);
  };
  const auto in_slice = [&](int k) {
    const float a = along(i.y(), k);
    return a + t.y() * (along(next.y(), k) - a);
  };
  const float a = in_slice(i.z());
  return a + t.z() * (in_slice(next.z()) - a);
}

float Sampler::cubic(const Eigen::Vector3d& index) const {
  const Grid& grid = volume_.grid;
  std::array<std::array<int, 4>, 3> at;
  std::array<std::array<double, 4>, 3> weight;
  for (int axis = 0; axis < 3; ++axis) {
    const int base = static_cast<int>(std::floor(index[axis]));
    weight[static_cast<std::size_t>(axis)] = cubic_weights(index[axis] - base);
    for (int a = 0; a < 4; ++a)
      at[static_cast<std::size_t>(axis)][static_cast<std::size_t>(a)] = mirrored(base - 1 + a, grid.size[axis]);
  }
  double sum = 0;
  for (std::size_t c = 0; c < 4; ++c)
    for (std::size_t b = 0; b < 4; ++b) {
      const double outer = weight[2][c] * weight[1][b];
      for (std::size_t a = 0; a < 4; ++a)
        sum += outer * weight[0][a] * coefficients_[grid.index(at[0][a], at[1][b], at[2][c])];
    }
  return static_cast<float>(sum);
}

}  // namespace supine::warp
