// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/intensity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using testing::message_of;

GreyImage uniform(int size, float grey) {
  GreyImage image;
  image.grid.size.setConstant(size);
  image.grid.spacing_mm = {2, 2, 3};
  image.voxels.assign(image.grid.count(), grey);
  return image;
}

/// Magnitude of a complex signal with normal noise in both parts.
void add_rician_noise(GreyImage& image, double sigma, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal(0, sigma);
  for (float& grey : image.voxels) grey = static_cast<float>(std::hypot(grey + normal(generator), normal(generator)));
}

TEST(Intensity, NoiseFloorIsFoundAndTakenOff) {
  GreyImage image = uniform(40, 0);
  for (std::size_t n = 0; n < image.voxels.size() / 2; ++n) image.voxels[n] = 100;
  add_rician_noise(image, 10, 1);
  // 64,000 voxels: the median of half of them is known to about 0.5 %.
  EXPECT_NEAR(remove_noise_floor(image, {50}), 10, 0.2);
  double squares = 0;
  for (std::size_t n = 0; n < image.voxels.size() / 2; ++n)
    squares += static_cast<double>(image.voxels[n]) * image.voxels[n];
  EXPECT_NEAR(std::sqrt(squares / (static_cast<double>(image.voxels.size()) / 2)), 100, 0.6);
}

TEST(Intensity, NoiseFloorRefusesAnImageWithoutAir) {
  GreyImage image = uniform(4, 100);
  EXPECT_NE(message_of([&] { remove_noise_floor(image, {50}); }).find("air_below = 50"), std::string::npos);
}

TEST(Intensity, BiasOfItsOwnDegreeIsRemovedExactly) {
  GreyImage image = uniform(12, 0);
  const Grid& grid = image.grid;
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i) {
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k)) / 36;
        const double shading = std::exp(0.4 * p.x() - 0.3 * p.y() * p.z() + 0.2 * p.y() * p.y());
        const bool dark = i > 3 && i < 7 && j > 3 && j < 7;  // another tissue
        image.at(i, j, k) = static_cast<float>(shading * (dark ? 300 : 700));
      }
  const BiasFit fit = correct_bias(image, {{550, INFINITY}, 2, 100});
  EXPECT_NEAR(fit.residual_sd, 0, 1e-6);
  EXPECT_NEAR(image.at(0, 0, 0), 100, 1e-3);
  EXPECT_NEAR(image.at(11, 11, 11), 100, 1e-3);
  EXPECT_NEAR(image.at(5, 5, 5), 300.0 / 7, 1e-3);
}

/// More voxels than are fitted: the fit tells of them all, and their outliers are no tissue either.
TEST(Intensity, BiasOfALargeVolumeIsThatOfAllItsVoxels) {
  constexpr int size = 130;
  GreyImage image = uniform(size, 0);
  std::size_t others = 0;
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) {
        const bool other = i > 40 && i < 50 && j > 40 && j < 50;
        others += other;
        image.at(i, j, k) = static_cast<float>((other ? 900 : 700) * std::exp(0.006 * i - 0.004 * k));
      }
  const BiasFit fit = correct_bias(image, {{1, INFINITY}, 2, 100});
  const auto tissue = static_cast<double>(image.voxels.size() - others);
  EXPECT_NEAR(static_cast<double>(fit.voxels), tissue, 0.01 * tissue);
  EXPECT_NEAR(image.at(0, 0, 0), 100, 0.1);
  EXPECT_NEAR(image.at(size - 1, size - 1, size - 1), 100, 0.1);
}

TEST(Intensity, BiasIsNotCarriedBeyondWhatTheTissueShows) {
  GreyImage image = uniform(30, 5);  // air
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 10; ++i)  // fat, darker from plane to plane
        image.at(i, j, k) = static_cast<float>(900 * std::exp(-0.15 * i));
  const float darkest_fat = image.at(9, 0, 0);
  correct_bias(image, {{50, 1000}, 1, 100});
  EXPECT_NEAR(image.at(9, 0, 0), 100, 1e-3);
  EXPECT_NEAR(image.at(29, 0, 0), 100 * 5 / darkest_fat, 1e-3);  // carried on, the field would make it 20 times that
}

TEST(Intensity, BiasIgnoresOutliersOfAnotherTissue) {
  GreyImage image = uniform(14, 700);
  for (std::size_t n = 0; n < image.voxels.size(); n += 10) image.voxels[n] = 560;
  std::mt19937 generator(3);
  for (float& grey : image.voxels) grey *= std::exp(std::normal_distribution<float>(0, 0.01f)(generator));
  correct_bias(image, {{500, INFINITY}, 2, 100});
  EXPECT_NEAR(image.at(1, 0, 0), 100, 4);
  EXPECT_NEAR(image.at(0, 0, 0), 80, 4);
}

TEST(Intensity, BiasRefusesTooFewVoxels) {
  GreyImage image = uniform(4, 100);
  EXPECT_NE(message_of([&] { correct_bias(image, {{500, INFINITY}, 2, 100}); }).find("0 voxels"), std::string::npos);
}

TEST(Intensity, MedianTakesOffSpecksAndGaussianKeepsTheMean) {
  GreyImage image = uniform(9, 10);
  image.at(4, 4, 4) = 1000;
  GreyImage median = image;
  smooth(median, {Smooth::Kind::median, 3});  // 1 voxel along every axis
  EXPECT_EQ(median.at(4, 4, 4), 10);
  smooth(image, {Smooth::Kind::gaussian, 2});
  EXPECT_LT(image.at(4, 4, 4), 200);
  EXPECT_GT(image.at(3, 4, 4), image.at(4, 4, 3));  // 2 mm away along i, 3 mm along k
}

}  // namespace
}  // namespace supine::segmentation
