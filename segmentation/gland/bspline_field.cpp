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

/// Along a row the weights across it are the same for all: the control points are summed with them once.
void BSplineField::Lattice::add_row(int j, int k, std::vector<float>& values) const {
  const auto &wy = axis[1].weight[j], &wz = axis[2].weight[k];
  const auto points = static_cast<std::size_t>(axis[0].points);
  std::vector<float> across(points, 0);
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b) {
      const float* from = control.data() + points * (axis[1].first[j] + b +
                                                     static_cast<std::size_t>(axis[1].points) * (axis[2].first[k] + c));
      for (std::size_t n = 0; n < points; ++n) across[n] += wz[c] * wy[b] * from[n];
    }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto& wx = axis[0].weight[i];
    const float* at = across.data() + axis[0].first[i];
    values[i] += wx[0] * at[0] + wx[1] * at[1] + wx[2] * at[2] + wx[3] * at[3];
  }
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
  const auto same_points = [&lattice](const Lattice& other) {
    return std::equal(std::begin(lattice.axis), std::end(lattice.axis), std::begin(other.axis),
                      [](const Axis& a, const Axis& b) { return a.points == b.points; });
  };
  const auto same = std::find_if(lattices_.begin(), lattices_.end(), same_points);
  if (same == lattices_.end())
    lattices_.push_back(std::move(lattice));
  else  // two fields over the same control points are one
    for (std::size_t n = 0; n < count; ++n) same->control[n] += lattice.control[n];
}

double BSplineField::at(int i, int j, int k) const {
  double sum = constant_;
  for (const Lattice& lattice : lattices_) sum += lattice.at(i, j, k);
  return sum;
}

std::vector<float> BSplineField::row(int j, int k) const {
  std::vector<float> values(static_cast<std::size_t>(grid_.size.x()), static_cast<float>(constant_));
  for (const Lattice& lattice : lattices_) lattice.add_row(j, k, values);
  return values;
}

std::vector<float> BSplineField::evaluate() const {
  std::vector<float> field(grid_.count());
#pragma omp parallel for schedule(static)
  for (int k = 0; k < grid_.size.z(); ++k)
    for (int j = 0; j < grid_.size.y(); ++j) {
      const std::vector<float> values = row(j, k);
      std::copy(values.begin(), values.end(), field.begin() + static_cast<std::ptrdiff_t>(grid_.index(0, j, k)));
    }
  return field;
}

}  // namespace supine::segmentation
