// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>

#include "segmentation/masks.h"

namespace supine::segmentation {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

/// One line: f(q) becomes min over p of f(p) + ((q - p) spacing)^2.
class LineEnvelope {
 public:
  explicit LineEnvelope(int length) : vertex_(length), border_(length + 1), values_(length) {}

  void run(float* first, std::size_t stride, int length, double spacing) {
    int top = -1;
    for (int q = 0; q < length; ++q) {
      values_[q] = first[q * stride];
      if (std::isinf(values_[q])) continue;
      double cross = -std::numeric_limits<double>::infinity();
      while (top >= 0 && (cross = crossing(vertex_[top], q, spacing)) <= border_[top]) --top;
      if (top < 0) cross = -std::numeric_limits<double>::infinity();
      vertex_[++top] = q;
      border_[top] = cross;
    }
    if (top < 0) return;
    for (int q = 0, at = 0; q < length; ++q) {
      while (at < top && border_[at + 1] < q) ++at;
      const double step = (q - vertex_[at]) * spacing;
      first[q * stride] = static_cast<float>(values_[vertex_[at]] + step * step);
    }
  }

 private:
  /// Where the parabolas over p < q meet, in voxels.
  double crossing(int p, int q, double spacing) const {
    const double s2 = spacing * spacing;
    return 0.5 * ((values_[q] - values_[p]) / (s2 * (q - p)) + q + p);
  }
  std::vector<int> vertex_;
  std::vector<double> border_, values_;
};

void transform_axis(std::vector<float>& field, const Grid& grid, int axis) {
  const auto nx = static_cast<std::size_t>(grid.size.x()), nxy = nx * grid.size.y();
  const std::size_t strides[3] = {1, nx, nxy};
  const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
#pragma omp parallel
  {
    LineEnvelope envelope(grid.size[axis]);
#pragma omp for schedule(static)
    for (int b = 0; b < grid.size[v]; ++b)
      for (int a = 0; a < grid.size[u]; ++a)
        envelope.run(field.data() + a * strides[u] + b * strides[v], strides[axis], grid.size[axis],
                     grid.spacing_mm[axis]);
  }
}

Mask complement(const Mask& mask) {
  Mask result(mask.size());
  for (std::size_t n = 0; n < mask.size(); ++n) result[n] = !mask[n];
  return result;
}

/// Voxels from low to high, both included; empty when high < low.
struct Box {
  Eigen::Vector3i low, high;
};

/// What lies within radius_mm of the mask, and a little more.
Box reach_of(const Mask& mask, const Grid& grid, double radius_mm) {
  Box box{grid.size, Eigen::Vector3i::Constant(-1)};
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j) {
      const auto first = mask.begin() + static_cast<std::ptrdiff_t>(grid.index(0, j, k)), end = first + grid.size.x();
      const auto in = std::find_if(first, end, [](std::uint8_t m) { return m != 0; });
      if (in == end) continue;
      auto last = end - 1;
      while (*last == 0) --last;
      box.low = box.low.cwiseMin(Eigen::Vector3i(static_cast<int>(in - first), j, k));
      box.high = box.high.cwiseMax(Eigen::Vector3i(static_cast<int>(last - first), j, k));
    }
  if (box.high.x() < 0) return box;
  for (int a = 0; a < 3; ++a) {
    const int more = static_cast<int>(std::min<double>(grid.size[a], radius_mm / grid.spacing_mm[a] + 1));
    box.low[a] = std::max(0, box.low[a] - more);
    box.high[a] = std::min(grid.size[a] - 1, box.high[a] + more);
  }
  return box;
}

/// f(index in the grid, index in the part that the box is, voxels) for every row of the box.
template <class F>
void for_each_row(const Box& box, const Grid& grid, const Grid& part, const F& f) {
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j)
      f(grid.index(box.low.x(), j, k), part.index(0, j - box.low.y(), k - box.low.z()), part.size.x());
}

}  // namespace

std::vector<float> squared_distance_mm2(const Mask& mask, const Grid& grid) {
  std::vector<float> field(mask.size());
  for (std::size_t n = 0; n < mask.size(); ++n) field[n] = mask[n] ? 0.0f : infinite;
  for (int axis = 0; axis < 3; ++axis) transform_axis(field, grid, axis);
  return field;
}

Mask dilate(const Mask& mask, const Grid& grid, double radius_mm) {
  Mask result(mask.size(), 0);
  const Box box = reach_of(mask, grid, radius_mm);
  if ((box.high.array() < box.low.array()).any()) return result;
  Grid part = grid;
  part.size = box.high - box.low + Eigen::Vector3i::Ones();
  Mask inside(part.count());
  for_each_row(box, grid, part, [&](std::size_t from, std::size_t to, int count) {
    std::copy_n(mask.begin() + static_cast<std::ptrdiff_t>(from), count,
                inside.begin() + static_cast<std::ptrdiff_t>(to));
  });
  const std::vector<float> distance = squared_distance_mm2(inside, part);
  // A hair beyond the radius, so that a whole number of voxels is reached whatever the rounding.
  const auto bound = static_cast<float>(radius_mm * radius_mm * (1 + 1e-5));
  for_each_row(box, grid, part, [&](std::size_t to, std::size_t from, int count) {
    for (int i = 0; i < count; ++i) result[to + i] = distance[from + i] <= bound;
  });
  return result;
}

Mask erode(const Mask& mask, const Grid& grid, double radius_mm) {
  return complement(dilate(complement(mask), grid, radius_mm));
}

}  // namespace supine::segmentation
