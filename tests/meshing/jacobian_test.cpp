// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/jacobian.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "meshing/topology.h"

namespace supine {
namespace {

using meshing::QuadraticNodes;

QuadraticNodes straight(const Eigen::Matrix<double, 4, 3>& corners) {
  QuadraticNodes x;
  x.topRows(4) = corners;
  for (int e = 0; e < 6; ++e)
    x.row(4 + e) = (corners.row(meshing::tet_edges[e][0]) + corners.row(meshing::tet_edges[e][1])) / 2;
  return x;
}

Eigen::Matrix<double, 4, 3> unit_corners() {
  Eigen::Matrix<double, 4, 3> x;
  x << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  return x;
}

QuadraticNodes shaken(double by, unsigned seed) {
  QuadraticNodes x = straight(unit_corners());
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shift(-by, by);
  for (int k = 4; k < 10; ++k)
    for (int d = 0; d < 3; ++d) x(k, d) += shift(random);
  return x;
}

// From the shape functions, not from the Bernstein form.
double determinant_at(const QuadraticNodes& x, const Eigen::Vector4d& l) {
  Eigen::Matrix<double, 3, 4> by;  // ∂x/∂l
  for (int k = 0; k < 4; ++k) by.col(k) = (4 * l[k] - 1) * x.row(k).transpose();
  for (int e = 0; e < 6; ++e) {
    const auto [a, b] = meshing::tet_edges[e];
    by.col(a) += 4 * l[b] * x.row(4 + e).transpose();
    by.col(b) += 4 * l[a] * x.row(4 + e).transpose();
  }
  Eigen::Matrix3d j;
  for (int k = 0; k < 3; ++k) j.col(k) = by.col(k + 1) - by.col(0);
  return j.determinant();
}

template <class Visit>
void on_grid(int n, const Visit& visit) {
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j)
      for (int k = 0; i + j + k <= n; ++k) visit(Eigen::Vector4d(n - i - j - k, i, j, k) / n);
}

double sampled_smallest(const QuadraticNodes& x, int n) {
  double low = 1e300;
  on_grid(n, [&](const Eigen::Vector4d& l) { low = std::min(low, determinant_at(x, l)); });
  return low;
}

TEST(Jacobian, StraightEdgesHaveAllCoefficientsEqual) {
  const QuadraticNodes x = straight(2 * unit_corners());
  for (const double c : meshing::jacobian_coefficients(x)) EXPECT_NEAR(c, 8, 1e-12);
  EXPECT_NEAR(meshing::curved_volume_mm3(x), 8.0 / 6, 1e-12);
  const auto j = meshing::smallest_scaled_jacobian(x);
  EXPECT_NEAR(j.low, 1, 1e-12);
  EXPECT_NEAR(j.high, 1, 1e-12);
}

TEST(Jacobian, CoefficientsHoldTheDeterminantBetweenThem) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const QuadraticNodes x = shaken(0.2, seed);
    const auto c = meshing::jacobian_coefficients(x);
    const auto [low, high] = std::minmax_element(c.begin(), c.end());
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(c[k], determinant_at(x, Eigen::Vector4d::Unit(k)), 1e-12);
    on_grid(12, [&, low = low, high = high](const Eigen::Vector4d& l) {
      EXPECT_GE(determinant_at(x, l), *low - 1e-12);
      EXPECT_LE(determinant_at(x, l), *high + 1e-12);
    });
  }
}

TEST(Jacobian, SubdivisionFindsTheSmallestValue) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const QuadraticNodes x = shaken(0.25, seed);
    const auto j = meshing::smallest_scaled_jacobian(x, 1e-3);
    const double sampled = sampled_smallest(x, 40);
    EXPECT_LE(j.low, j.high);
    EXPECT_LE(j.high - j.low, 1e-3);
    EXPECT_LE(j.low, sampled);          // a bound: no sample is below it
    EXPECT_LE(sampled, j.high + 0.02);  // and close: samples 1/40 apart come near to it
  }
}

// Positive at all nodes, corners and quadrature points, negative in between: what sampling does not see.
TEST(Jacobian, InversionBetweenTheNodesIsFound) {
  int hidden = 0;
  for (unsigned seed = 0; seed < 4000; ++seed) {
    const QuadraticNodes x = shaken(0.3, seed);
    const double at_nodes = sampled_smallest(x, 2), inside = sampled_smallest(x, 24);
    if (!(at_nodes > 0 && inside < 0)) continue;
    ++hidden;
    EXPECT_FALSE(meshing::scaled_jacobian_exceeds(x, 0)) << seed;
    EXPECT_LE(meshing::smallest_scaled_jacobian(x).high, inside + 1e-3) << seed;
  }
  EXPECT_GT(hidden, 20);
}

TEST(Jacobian, BoundsAgreeWithTheQuestion) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    const QuadraticNodes x = shaken(0.25, seed);
    const auto j = meshing::smallest_scaled_jacobian(x, 1e-6);
    EXPECT_TRUE(meshing::scaled_jacobian_exceeds(x, j.low - 1e-6));
    EXPECT_FALSE(meshing::scaled_jacobian_exceeds(x, j.high + 1e-6));
  }
}

TEST(Jacobian, RigidMotionAndScaleChangeNothing) {
  const QuadraticNodes x = shaken(0.2, 7);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  QuadraticNodes y = 25 * x * turn.transpose();
  y.rowwise() += Eigen::RowVector3d(100, -200, 50);
  EXPECT_NEAR(meshing::smallest_scaled_jacobian(x, 1e-6).low, meshing::smallest_scaled_jacobian(y, 1e-6).low, 2e-6);
  EXPECT_NEAR(meshing::curved_volume_mm3(y), 25 * 25 * 25 * meshing::curved_volume_mm3(x), 1e-8);
}

// The mean of the determinant by a fine rule, and a map with a known volume: x → x + x(1 - x)... through its nodes.
TEST(Jacobian, VolumeIsTheIntegralOfTheDeterminant) {
  // (a, b, c) → (a + s b², b, c) is quadratic, so the ten nodes carry it exactly; its determinant is 1.
  QuadraticNodes x = straight(unit_corners());
  for (int k = 0; k < 10; ++k) x(k, 0) += 0.4 * x(k, 1) * x(k, 1);
  EXPECT_NEAR(meshing::curved_volume_mm3(x), 1.0 / 6, 1e-14);
  // (a + s a², b, c): determinant 1 + 2 s a, whose integral over the tetrahedron is 1/6 + 2 s / 24.
  QuadraticNodes y = straight(unit_corners());
  for (int k = 0; k < 10; ++k) y(k, 0) += 0.4 * y(k, 0) * y(k, 0);
  EXPECT_NEAR(meshing::curved_volume_mm3(y), 1.0 / 6 + 0.8 / 24, 1e-14);
  EXPECT_NEAR(meshing::smallest_scaled_jacobian(y, 1e-9).low, 1 / 1.4, 1e-8);  // 1 over the straight one's 1.4
}

TEST(Jacobian, AreaOfACurvedFace) {
  // The parabolic cylinder z = s x² over the unit triangle: ∫ (1 - x) sqrt(1 + 4 s² x²) dx.
  const double s = 0.15;
  Points points(6, 3);
  points << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0.5, 0;
  for (int k = 0; k < 6; ++k) points(k, 2) = s * points(k, 0) * points(k, 0);
  Indices faces(1, 6);
  faces << 0, 1, 2, 3, 4, 5;
  double area = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double x = (i + 0.5) / n;
    area += (1 - x) * std::sqrt(1 + 4 * s * s * x * x) / n;
  }
  EXPECT_NEAR(meshing::curved_area_mm2(points, faces, 0), area, 1e-6);
}

}  // namespace
}  // namespace supine
