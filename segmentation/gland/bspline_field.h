// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <span>
#include <vector>

#include "segmentation/image.h"

namespace supine::segmentation {

/// A value with a weight at a voxel.
struct FieldSample {
  int i, j, k;
  float value;   ///< anything finite
  float weight;  ///< >= 0; 0 takes no part
};

/// A smooth scalar field over a grid: the sum of uniform cubic B-splines on lattices along the grid's own axes.
///
/// add() lays one more lattice over it, by the weighted B-spline approximation of Lee, Wolberg and Shin (IEEE TVCG 3,
/// 1997) that N4 uses (Tustison et al., IEEE TMI 29, 2010): each sample pulls the 64 control points around it to what
/// they would be if it stood alone, and the pulls are averaged. Where no sample is near, the lattice is 0.
class BSplineField {
 public:
  explicit BSplineField(const Grid& grid, double constant = 0) : grid_(grid), constant_(constant) {}

  /// Adds the lattice that comes nearest to the samples. @param spacing_mm  of its control points, > 0
  void add(std::span<const FieldSample> samples, double spacing_mm);

  double at(int i, int j, int k) const;
  /// The field at the voxels (0, j, k), (1, j, k), ...; as at(), but for rounding, and far faster.
  std::vector<float> row(int j, int k) const;
  /// The field at every voxel (Grid::index order), on all cores.
  std::vector<float> evaluate() const;

 private:
  /// The four weights along an axis of every voxel, and the first control point they belong to.
  struct Axis {
    std::vector<int> first;
    std::vector<std::array<float, 4>> weight;
    int points = 0;
  };
  struct Lattice {
    Axis axis[3];
    std::vector<float> control;
    double at(int i, int j, int k) const;
    void add_row(int j, int k, std::vector<float>& values) const;
  };
  static Axis make_axis(int size, double voxel_mm, double spacing_mm);

  Grid grid_;
  double constant_;
  std::vector<Lattice> lattices_;
};

}  // namespace supine::segmentation
