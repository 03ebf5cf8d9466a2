// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <iterator>
#include <random>

#include "calibration/error_model.h"
#include "calibration/held_out.h"
#include "calibration/noise.h"
#include "common/error.h"

namespace supine::calibration {
namespace {

/// Points on a patch of a paraboloid, 120 mm wide, with noise and an error that neighbouring points share.
Residuals patch(int count, double noise_mm, double shared_mm, double length_mm, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-60, 60);
  Residuals r;
  r.place.resize(count, 3);
  for (int i = 0; i < count; ++i) {
    const double x = uniform(generator), y = uniform(generator);
    r.place.row(i) << x, y, -(x * x + y * y) / 150;
  }
  r.on_skin = r.place;
  r.q = r.place.leftCols<2>() / 60;
  r.sigma_mm = Eigen::VectorXd::Constant(count, noise_mm);
  r.pose = Eigen::VectorXi::Zero(count);
  r.point = Eigen::VectorXi::LinSpaced(count, 0, count - 1);
  Eigen::MatrixXd sigma(count, count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      sigma(i, j) = shared_mm * shared_mm * std::exp(-(r.place.row(i) - r.place.row(j)).norm() / length_mm) +
                    (i == j ? noise_mm * noise_mm : 0);
  Eigen::VectorXd z(count);
  for (double& number : z) number = normal(generator);
  r.distance_mm = Eigen::LLT<Eigen::MatrixXd>(sigma).matrixL() * z;
  return r;
}

Residuals permuted(const Residuals& r, unsigned seed) {
  std::vector<int> order(static_cast<std::size_t>(r.size()));
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  Residuals p = r;
  p.distance_mm = r.distance_mm(order);
  p.place = p.on_skin = r.place(order, Eigen::all);
  p.q = r.q(order, Eigen::all);
  return p;
}

Eigen::MatrixXd smooth_slopes(const Residuals& r) {
  Eigen::MatrixXd slope(r.size(), 2);
  slope.col(0) = r.place.col(0).array() / 60;
  slope.col(1) = (r.place.col(1).array() / 40).sin();
  return slope;
}

TEST(Noise, IsFoundUnderAModelErrorTenTimesAsLong) {
  for (const double noise : {0.3, 0.7, 1.5}) {
    const Residuals r = patch(1500, noise, 0.7, 60, 11);
    EXPECT_NEAR(estimate_noise_mm(r.place, r.distance_mm), noise, 0.12 * noise + 0.02) << noise;
  }
}

TEST(Noise, IsNotLowByPointsThatErrAlikeLyingNearer) {
  constexpr double spacing_mm = 2.4, noise_mm = 0.7;
  std::mt19937 generator(5);
  std::normal_distribution<double> normal(0, noise_mm);
  Points on_skin(3600, 3), place;
  Eigen::VectorXd distance_mm(3600);
  for (int i = 0; i < 3600; ++i) {
    on_skin.row(i) << spacing_mm * (i % 60), spacing_mm * (i / 60), 0;
    distance_mm[i] = normal(generator);
  }
  place = on_skin;
  place.col(2) = distance_mm;
  EXPECT_NEAR(estimate_noise_mm(on_skin, distance_mm), noise_mm, 0.02);
  EXPECT_LT(estimate_noise_mm(place, distance_mm), estimate_noise_mm(on_skin, distance_mm));
}

TEST(Noise, OfPointsOnARidgeIsFound) {
  std::mt19937 generator(6);
  std::normal_distribution<double> normal(0, 0.7);
  Points line = Points::Zero(400, 3);
  Eigen::VectorXd distance_mm(400);
  for (int i = 0; i < 400; ++i) line(i, 0) = 0.5 * i, distance_mm[i] = normal(generator);
  EXPECT_NEAR(estimate_noise_mm(line, distance_mm), 0.7, 0.08);
}

TEST(Noise, NeedsPoints) {
  const Residuals r = patch(39, 0.7, 0, 10, 1);
  EXPECT_THROW(estimate_noise_mm(r.place, r.distance_mm), InputError);
}

TEST(Noise, OneInTwentyPointsOffByFiveMillimetresIsFound) {
  Residuals r = patch(2000, 0.7, 0.7, 60, 12);
  EXPECT_LE(points_that_stand_out(r.place, r.distance_mm, 0.7).size(), 1u);
  std::vector<int> moved;
  for (int i = 7; i < 2000; i += 20) {
    const double off_mm = i % 40 < 20 ? 5 : -5;
    r.distance_mm[i] += off_mm;
    r.place.row(i) += off_mm * Eigen::RowVector3d(r.place(i, 0) / 75, r.place(i, 1) / 75, 1).normalized();
    moved.push_back(i);
  }
  EXPECT_NEAR(estimate_noise_mm(r.place, r.distance_mm), 0.7, 0.15);
  const std::vector<int> found = points_that_stand_out(r.place, r.distance_mm, 0.7);
  std::vector<int> right;
  std::set_intersection(found.begin(), found.end(), moved.begin(), moved.end(), std::back_inserter(right));
  EXPECT_GE(right.size(), 95u) << "of 100";
  EXPECT_LE(found.size() - right.size(), 2u);
}

TEST(ErrorModel, WhiteNoiseSharesNothing) {
  const Residuals r = patch(1000, 0.7, 0, 10, 2);
  const ErrorModel model = fit_error_model(r, smooth_slopes(r));
  EXPECT_NEAR(model.nugget_mm, 0.7, 0.07);
  EXPECT_LT(model.spread_mm, 0.2);
}

TEST(ErrorModel, FindsNoiseAndSharedErrorApart) {
  const Residuals r = patch(1000, 0.7, 1.0, 18, 3);
  const ErrorModel model = fit_error_model(r, smooth_slopes(r));
  EXPECT_NEAR(model.nugget_mm, 0.7, 0.15);
  EXPECT_NEAR(model.spread_mm, 1.0, 0.4);
  EXPECT_LT(model.effective_count(r), 0.2 * 1000);
}

TEST(ErrorModel, NoiseThatNeighboursShareCountsAsThatOfFewerPoints) {
  // Every place measured four times, 0.3 mm apart, with the same noise: worth a quarter of the points.
  const Residuals single = patch(400, 0.6, 0, 10, 12);
  Residuals r = patch(1600, 0.6, 0, 10, 12);
  for (Eigen::Index i = 0; i < 1600; ++i) {
    r.place.row(i) = r.on_skin.row(i) =
        single.place.row(i / 4) + Eigen::RowVector3d(0.3 * (i % 2), 0.3 * ((i / 2) % 2), 0);
    r.distance_mm[i] = single.distance_mm[i / 4];
  }
  const ErrorModel model = fit_error_model(r, smooth_slopes(r));
  EXPECT_NEAR(model.nugget_mm, 1.2, 0.25);  // of independent points that average like these
  EXPECT_LT(model.spread_mm, 0.3);
}

TEST(ErrorModel, DoesNotDependOnTheOrderOfThePoints) {
  const Residuals r = patch(700, 0.7, 1.0, 18, 4), p = permuted(r, 5);
  const ErrorModel a = fit_error_model(r, smooth_slopes(r)), b = fit_error_model(p, smooth_slopes(p));
  EXPECT_NEAR(a.nugget_mm, b.nugget_mm, 1e-9);
  EXPECT_NEAR(a.spread_mm, b.spread_mm, 1e-9);
}

TEST(ErrorModel, WeightedProductIsThatOfTheDenseCovariance) {
  const Residuals r = patch(300, 0.7, 1.0, 18, 6);
  const ErrorModel model{0.6, 1.1, 20};
  Eigen::MatrixXd sigma(300, 300);
  for (int i = 0; i < 300; ++i)
    for (int j = 0; j < 300; ++j)
      sigma(i, j) = 1.21 * std::exp(-(r.place.row(i) - r.place.row(j)).norm() / 20) + (i == j ? 0.36 : 0);
  const Eigen::MatrixXd a = smooth_slopes(r), exact = a.transpose() * sigma * a;
  EXPECT_LT((weighted_product(model, r, a, a) - exact).norm(), 1e-10 * exact.norm());
  const double count = std::pow(sigma.trace(), 2) / sigma.squaredNorm();
  EXPECT_NEAR(model.effective_count(r), count, 1e-8 * count);
}

TEST(HeldOut, BlocksAreSixPiecesThatDoNotDependOnOrder) {
  const Residuals r = patch(900, 0.7, 0, 10, 7), p = permuted(r, 8);
  const Eigen::VectorXi block = spatial_blocks(r), other = spatial_blocks(p);
  for (int b = 0; b < 6; ++b) EXPECT_GT((block.array() == b).count(), 40) << b;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    for (Eigen::Index j = 0; j < r.size(); j += 37)
      if (p.place.row(j) == r.place.row(i)) {
        EXPECT_EQ(block[i], other[j]);
      }
}

TEST(HeldOut, EveryPointBelongsToTheBlockWhoseMeanIsNearest) {
  const Residuals r = patch(900, 0.7, 0, 10, 7);
  const Eigen::VectorXi block = spatial_blocks(r);
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(6, 2);
  for (Eigen::Index i = 0; i < r.size(); ++i)
    mean.row(block[i]) += r.q.row(i) / static_cast<double>((block.array() == block[i]).count());
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    Eigen::Index nearest;
    (mean.rowwise() - r.q.row(i)).rowwise().squaredNorm().minCoeff(&nearest);
    EXPECT_EQ(block[i], nearest) << i;
  }
}

TEST(HeldOut, IsTheErrorOfAFitWithoutTheBlock) {
  Residuals r = patch(400, 0.7, 0.5, 15, 9);
  const Eigen::MatrixXd slope = smooth_slopes(r);
  const Eigen::VectorXd priors = Eigen::Vector2d(0.3, 4);
  const Eigen::VectorXi blocks = spatial_blocks(r);
  const double precision = 1 / (0.7 * 0.7);
  // Move to the optimum of points and priors (mean of the priors: the start, two steps away), as after a fit.
  const Eigen::MatrixXd h = precision * slope.transpose() * slope + Eigen::MatrixXd(priors.asDiagonal());
  const Eigen::VectorXd optimum = -h.ldlt().solve(precision * slope.transpose() * r.distance_mm);
  const Eigen::VectorXd start = r.distance_mm;
  r.distance_mm += slope * optimum;
  const Eigen::VectorXd predicted = held_out_distances(r, slope, priors, blocks);
  for (int b = 0; b < 6; ++b) {
    const Eigen::VectorXd kept = (blocks.array() != b).cast<double>() * precision;
    const Eigen::MatrixXd hb = slope.transpose() * kept.asDiagonal() * slope + Eigen::MatrixXd(priors.asDiagonal());
    const Eigen::VectorXd without = -hb.ldlt().solve(slope.transpose() * kept.cwiseProduct(start));
    for (Eigen::Index i = 0; i < r.size(); ++i)
      if (blocks[i] == b) {
        ASSERT_NEAR(predicted[i], start[i] + slope.row(i).dot(without), 1e-10);
      }
  }
}

TEST(HeldOut, IsLargerThanTheErrorOfTheFitForManyParametersOnNoise) {
  Residuals r = patch(400, 0.7, 0, 15, 10);
  Eigen::MatrixXd slope(400, 12);
  for (int k = 0; k < 12; ++k)
    slope.col(k) =
        (r.place.col(k % 2).array() * (k + 1) / 80).sin() * (r.place.col((k + 1) % 2).array() / 50 + k).cos();
  r.distance_mm -= slope * slope.colPivHouseholderQr().solve(r.distance_mm).eval();
  const Eigen::VectorXd out = held_out_distances(r, slope, Eigen::VectorXd::Zero(12), spatial_blocks(r));
  EXPECT_GT(out.norm(), 1.02 * r.distance_mm.norm());
}

}  // namespace
}  // namespace supine::calibration
