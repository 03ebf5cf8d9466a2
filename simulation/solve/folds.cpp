// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/folds.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "meshing/jacobian.h"

namespace supine::simulation {
namespace {

constexpr int quadratic_nodes = 10;

}  // namespace

Folds find_folds(const Indices& cells, const Points& shape) {
  Folds folds;
  if (cells.cols() != quadratic_nodes) return folds;
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    meshing::QuadraticNodes nodes;
    for (int a = 0; a < quadratic_nodes; ++a) nodes.row(a) = shape.row(cells(c, a));
    const auto coefficients = meshing::jacobian_coefficients(nodes);
    const auto least = std::min_element(coefficients.begin(), coefficients.end());
    if (*least > 0) continue;
    const auto corner = std::min_element(coefficients.begin(), coefficients.begin() + 4);
    // Bernstein bounds of the whole cell may be too wide; those of its parts decide.
    const Eigen::Vector3d a = nodes.row(1) - nodes.row(0), b = nodes.row(2) - nodes.row(0),
                          d = nodes.row(3) - nodes.row(0);
    if (*corner > 0 && a.cross(b).dot(d) > 0 && meshing::scaled_jacobian_exceeds(nodes, 0)) continue;
    const double mean = std::accumulate(coefficients.begin(), coefficients.end(), 0.0) / coefficients.size();
    const double worst = (*corner <= 0 ? *corner : *least) / std::abs(mean);
    if (folds.cells == 0 || worst < folds.worst) {
      folds.worst = worst;
      folds.worst_cell = static_cast<int>(c);
      folds.place_mm = nodes.row(static_cast<int>(corner - coefficients.begin())).transpose();
    }
    ++folds.cells;
  }
  return folds;
}

std::string folds_warning(const std::string& name, const Folds& folds) {
  if (folds.cells == 0) return {};
  return fmt::format(
      "{}: {} quadratic cell{} inside out near a corner, the worst (cell {}, determinant there {:.2f} of its mean) at "
      "({:.1f}, {:.1f}, {:.1f}) mm. Between their quadrature points such cells mean nothing: the answer stands "
      "elsewhere; do not read anything into that place, or compare with linear cells (--order 1)",
      name, folds.cells, folds.cells == 1 ? " is" : "s are", folds.worst_cell, folds.worst, folds.place_mm.x(),
      folds.place_mm.y(), folds.place_mm.z());
}

}  // namespace supine::simulation
