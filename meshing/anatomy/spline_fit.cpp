// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/spline_fit.h"

#include <Eigen/CholmodSupport>
#include <Eigen/SparseCore>
#include <cmath>

#include "common/error.h"
#include "common/shared_random.h"

namespace supine::meshing {

SplineFit::SplineFit(const Eigen::Vector3i& size, double knot_mm)
    : size_(size),
      knot_mm_(knot_mm),
      matrix_(static_cast<std::size_t>(size.prod()) * half, 0.0),
      right_(Eigen::VectorXd::Zero(size.prod())) {}

void SplineFit::add_sample(const std::array<SplineWeights, 3>& w, double value, double weight) {
  std::array<int, 64> number, slot;  // slot: number of the coefficient within a 7³ stencil
  std::array<double, 64> product;
  for (int n = 0; n < 64; ++n) {
    const int i = n % 4, j = n / 4 % 4, k = n / 16;
    number[n] = index(w[0].first + i, w[1].first + j, w[2].first + k);
    slot[n] = i + 7 * j + 49 * k;
    product[n] = w[0].value[i] * w[1].value[j] * w[2].value[k];
  }
  for (int n = 0; n < 64; ++n) {
    right_[number[n]] += weight * product[n] * value;
    double* row = &matrix_[static_cast<std::size_t>(number[n]) * half];
    for (int m = 0; m <= n; ++m) row[slot[n] - slot[m]] += weight * product[n] * product[m];
  }
}

void SplineFit::add_energy(const std::array<double, 4>& weight) {
  const std::array<std::array<Eigen::MatrixXd, 4>, 3> gram = {spline_gram(size_.x()), spline_gram(size_.y()),
                                                              spline_gram(size_.z())};
  constexpr std::array<double, 4> factorial = {1, 1, 2, 6};
  std::array<std::array<std::array<double, 4>, 4>, 4> factor{};  // of the derivative (a, b, c)
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; a + b < 4; ++b) {
      for (int c = 0; a + b + c < 4; ++c) {
        const int m = a + b + c;
        factor[a][b][c] =
            weight[m] * std::pow(knot_mm_, 3 - 2 * m) * factorial[m] / (factorial[a] * factorial[b] * factorial[c]);
      }
    }
  }
  const auto couple = [&](int k, int r, int j, int q) {  // ∫ over y and z of the products, per derivative in x
    std::array<double, 4> sum{};
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; a + b < 4; ++b) {
        for (int c = 0; a + b + c < 4; ++c) sum[a] += factor[a][b][c] * gram[1][b](j, q) * gram[2][c](k, r);
      }
    }
    return sum;
  };
  for (int k = 0; k < size_.z(); ++k) {
    for (int r = std::max(0, k - 3); r <= k; ++r) {
      for (int j = 0; j < size_.y(); ++j) {
        for (int q = std::max(0, j - 3); q <= std::min(j + 3, size_.y() - 1); ++q) {
          const std::array<double, 4> yz = couple(k, r, j, q);
          for (int i = 0; i < size_.x(); ++i) {
            double* row = &matrix_[static_cast<std::size_t>(index(i, j, k)) * half];
            for (int p = std::max(0, i - 3); p <= std::min(i + 3, size_.x() - 1); ++p) {
              const int slot = (i - p) + 7 * (j - q) + 49 * (k - r);
              if (slot < 0) continue;
              for (int a = 0; a < 4; ++a) row[slot] += yz[a] * gram[0][a](i, p);
            }
          }
        }
      }
    }
  }
}

Eigen::VectorXd SplineFit::solve() const {
  Eigen::SparseMatrix<double> upper(right_.size(), right_.size());
  upper.reserve(Eigen::VectorXi::Constant(static_cast<int>(right_.size()), half));
  for (int k = 0; k < size_.z(); ++k) {
    for (int j = 0; j < size_.y(); ++j) {
      for (int i = 0; i < size_.x(); ++i) {
        const int column = index(i, j, k);
        for (int slot = half - 1; slot >= 0; --slot) {
          // slot = dx + 7 dy + 49 dz with every |d| <= 3
          const int dz = (slot + 24) / 49, dy = (slot - 49 * dz + 24) / 7 - 3, dx = slot - 49 * dz - 7 * dy;
          if (i < dx || j < dy || k < dz || i - dx >= size_.x() || j - dy >= size_.y()) continue;
          upper.insert(index(i - dx, j - dy, k - dz), column) = matrix_[static_cast<std::size_t>(column) * half + slot];
        }
      }
    }
  }
  upper.makeCompressed();
  const std::lock_guard alone(shared_random);  // CHOLMOD orders with METIS
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Upper> solver(upper);
  if (solver.info() != Eigen::Success) {
    throw NumericalFailure("the distance field of the muscle could not be fitted: the normal equations are singular");
  }
  return solver.solve(right_);
}

}  // namespace supine::meshing
