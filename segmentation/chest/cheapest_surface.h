// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace supine::segmentation {

/// A choice of one sample on every ray of a sheet of rays: rays of a row are neighbours, and rays of neighbouring rows.
struct SurfaceProblem {
  int rays = 0, rows = 0, samples = 0;
  std::vector<float> costs;  ///< of a sample: costs[(row * rays + ray) * samples + sample]
  double ray_slope = 0;      ///< cost of a step by one sample between neighbouring rays of a row; >= 0
  double row_slope = 0;      ///< the same between rows; >= 0
  double row_most = 0;       ///< a step between rows costs no more than this; > 0
};

/// The samples whose sum of costs and of steps is lowest, by sequential tree-reweighted message passing (Kolmogorov,
/// IEEE TPAMI 28, 2006): exact where rows do not meet, nearly so over the whole sheet, which sweeps over single rows
/// are not.
/// @return per ray, row by row
std::vector<int> cheapest_surface(const SurfaceProblem& problem);

}  // namespace supine::segmentation
