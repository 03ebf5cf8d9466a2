// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace supine::simulation {

/// Energy ½ Δbᵀ K Δb of a triangle of a plate whose bends about its edges (laws/hinge.h) change by Δb. Curvature is
/// that of the normals at the middle of the edges, each the mean of both sides: Λ = Σ b_i/(2 A ℓ_i) m_i ⊗ m_i, m_i the
/// edge turned by 90° and A the area (Grinspun, Gingold, Reisman and Zorin 2006), the energy
/// A D/2 [(1 − ν) tr Λ² + ν tr² Λ]. Exact for constant curvature on regular meshes.
/// @param first, second  ways from the triangle's first node to its others in the undeformed shape, mm
/// @param poisson  ν of the plate
/// @return K / D, without unit, row and column i of the edge from node i to node i + 1
template <class T>
Eigen::Matrix<T, 3, 3> triangle_bending(const Eigen::Matrix<T, 3, 1>& first, const Eigen::Matrix<T, 3, 1>& second,
                                        const T& poisson) {
  using std::sqrt;
  const Eigen::Matrix<T, 3, 1> edges[3] = {first, second - first, -second};
  const T area = 0.5 * first.cross(second).norm();
  Eigen::Matrix<T, 3, 3> stiffness;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const T along = edges[i].dot(edges[j]), length2 = edges[i].squaredNorm() * edges[j].squaredNorm();
      stiffness(i, j) = ((1.0 - poisson) * along * along + poisson * length2) / (4.0 * area * sqrt(length2));
    }
  return stiffness;
}

}  // namespace supine::simulation
