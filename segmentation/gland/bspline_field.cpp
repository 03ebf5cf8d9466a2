// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/bspline_field.h"

#include <algorithm>
#include <cmath>

namespace supine::segmentation {

BSplineField::Axis BSplineField::make_axis(int size, double voxel_mm, double spacing_mm) {
  Axis axis;
  const int spans = std::max(1, static_cast<int>(std::ceil((size - 1) * voxel_mm / spacing_mm)));
  axis.points = spans + 3;
  for (int n = 0; n < size; ++n) {
    const double at = size > 1 ? n * spans / static_cast<double>(size - 1) : 0;
    const int first = std::min(static_cast<int>(at), spans - 1);
    const auto t = static_cast<float>(at - first);
    const float s = 1 - t;
    axis.first.push_back(first);
    axis.weight.push_back(
        {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6});
  }
  return axis;
}

double BSplineField::Lattice::at(int i, int j, int k) const {
  const auto &wx = axis[0].weight[i], &wy = axis[1].weight[j], &wz = axis[2].weight[k];
  double sum = 0;
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b) {
      const float* row = control.data() + axis[0].first[i] +
                         static_cast<std::size_t>(axis[0].points) *
                             (axis[1].first[j] + b + static_cast<std::size_t>(axis[1].points) * (axis[2].first[k] + c));
      sum += wz[c] * wy[b] * (wx[0] * row[0] + wx[1] * row[1] + wx[2] * row[2] + wx[3] * row[3]);
    }
  return sum;
}

void BSplineField::add(std::span<const FieldSample> samples, double spacing_mm) {
  Lattice lattice;
  for (int a = 0; a < 3; ++a) lattice.axis[a] = make_axis(grid_.size[a], grid_.spacing_mm[a], spacing_mm);
  const auto nx = static_cast<std::size_t>(lattice.axis[0].points),
             ny = static_cast<std::size_t>(lattice.axis[1].points),
             count = nx * ny * static_cast<std::size_t>(lattice.axis[2].points);
  std::vector<double> pull(count, 0), weight(count, 0);
  for (const FieldSample& s : samples) {
    if (!(s.weight > 0)) continue;
    const auto &wx = lattice.axis[0].weight[s.i], &wy = lattice.axis[1].weight[s.j], &wz = lattice.axis[2].weight[s.k];
    const auto square = [](const std::array<float, 4>& w) {
      return static_cast<double>(w[0]) * w[0] + w[1] * w[1] + w[2] * w[2] + w[3] * w[3];
    };
    const double squares = square(wx) * square(wy) * square(wz);
    for (int c = 0; c < 4; ++c)
      for (int b = 0; b < 4; ++b)
        for (int a = 0; a < 4; ++a) {
          const std::size_t n = lattice.axis[0].first[s.i] + a +
                                nx * (lattice.axis[1].first[s.j] + b + ny * (lattice.axis[2].first[s.k] + c));
          const double w = wx[a] * wy[b] * wz[c];
          pull[n] += s.weight * w * w * (w * s.value / squares);
          weight[n] += s.weight * w * w;
        }
  }
  // A control point that hardly any sample sees is not drawn far by it.
  constexpr double held = 1e-4;
  lattice.control.resize(count);
  for (std::size_t n = 0; n < count; ++n) lattice.control[n] = static_cast<float>(pull[n] / (weight[n] + held));
  lattices_.push_back(std::move(lattice));
}

double BSplineField::at(int i, int j, int k) const {
  double sum = constant_;
  for (const Lattice& lattice : lattices_) sum += lattice.at(i, j, k);
  return sum;
}

std::vector<float> BSplineField::evaluate() const {
  std::vector<float> field(grid_.count());
#pragma omp parallel for schedule(static)
  for (int k = 0; k < grid_.size.z(); ++k)
    for (int j = 0; j < grid_.size.y(); ++j)
      for (int i = 0; i < grid_.size.x(); ++i) field[grid_.index(i, j, k)] = static_cast<float>(at(i, j, k));
  return field;
}

}  // namespace supine::segmentation
