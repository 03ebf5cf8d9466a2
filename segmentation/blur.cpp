// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/blur.h"

#include <algorithm>
#include <cmath>

namespace supine::segmentation {
namespace {

constexpr int passes = 3;

/// Mean over [q - half, q + half] of a line, as far as the line goes; the ends of the window count by their share.
class LineBox {
 public:
  LineBox(int length, double half)
      : sums_(static_cast<std::size_t>(length) + 1),
        line_(static_cast<std::size_t>(length)),
        half_(half),
        length_(length) {}

  /// All passes over a line; on a copy, because the voxels of most lines lie far apart.
  void run(float* first, std::size_t stride) {
    bool empty = true;
    for (int q = 0; q < length_; ++q) {
      line_[q] = first[q * stride];
      empty = empty && line_[q] == 0;
    }
    if (empty) return;
    for (int n = 0; n < passes; ++n) pass();
    for (int q = 0; q < length_; ++q) first[q * stride] = line_[q];
  }

 private:
  void pass() {
    for (int q = 0; q < length_; ++q) sums_[q + 1] = sums_[q] + line_[q];
    for (int q = 0; q < length_; ++q) {
      const double from = std::max(0.0, q + 0.5 - half_), to = std::min<double>(length_, q + 0.5 + half_);
      values_at(from, to, line_[q]);
    }
  }
  void values_at(double from, double to, float& value) const {
    value = static_cast<float>((integral(to) - integral(from)) / (to - from));
  }
  /// Of the piecewise constant line from its start to position x.
  double integral(double x) const {
    const int whole = std::min(static_cast<int>(x), length_ - 1);
    return sums_[whole] + (x - whole) * (sums_[whole + 1] - sums_[whole]);
  }
  std::vector<double> sums_;
  std::vector<float> line_;
  double half_;
  int length_;
};

}  // namespace

void gaussian_blur(std::vector<float>& field, const Grid& grid, double sigma_mm) {
  const auto nx = static_cast<std::size_t>(grid.size.x()), nxy = nx * grid.size.y();
  const std::size_t strides[3] = {1, nx, nxy};
  for (int axis = 0; axis < 3; ++axis) {
    const double sigma = sigma_mm / grid.spacing_mm[axis];
    if (grid.size[axis] < 2 || 3 * sigma < 1) continue;
    // A box of half width h has the variance h^2 / 3.
    const double half = std::max(0.5, sigma * std::sqrt(3.0 / passes));
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
#pragma omp parallel
    {
      LineBox box(grid.size[axis], half);
#pragma omp for schedule(static)
      for (int b = 0; b < grid.size[v]; ++b)
        for (int a = 0; a < grid.size[u]; ++a) box.run(field.data() + a * strides[u] + b * strides[v], strides[axis]);
    }
  }
}

}  // namespace supine::segmentation
