// SPDX-License-Identifier: AGPL-3.0-or-later
// The automatic recipes: a synthetic torso whose truth is known, and a real patient where the data are there.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <random>

#include "segmentation/chest/leaks.h"
#include "segmentation/chest/sampler.h"
#include "segmentation/formats/image_io.h"
#include "segmentation/label_map.h"
#include "segmentation/steps/recipe_toml.h"
#include "segmentation/steps/run_recipe.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

namespace fs = std::filesystem;

constexpr double front_y = 25, half_width = 140, half_depth = 110;  // of the chest

double chest(const Eigen::Vector3d& p) {
  return std::pow(p.x() / half_width, 2) + std::pow((p.y() - front_y - half_depth) / half_depth, 2);
}

/// Two breasts of 60 mm radius hanging 110 mm from a chest with 12 mm of fat on it.
bool in_body(const Eigen::Vector3d& p) {
  if (std::pow(p.x() / (half_width + 25), 2) + std::pow((p.y() - front_y - half_depth) / (half_depth + 12), 2) < 1)
    return true;
  const double across = std::hypot(std::abs(p.x()) - 75, p.z()), ahead = (front_y + 30 - p.y()) / 140;
  return ahead > 0 && std::pow(across / 60, 2) + ahead * ahead < 1;
}

/// Fat 800, chest 200, coil shading by a factor of two from front to back, Rician noise of 8.
GreyImage torso(double turn_rad) {
  GreyImage image;
  image.grid.size = {132, 104, 44};
  image.grid.spacing_mm = {2.6, 2.6, 4};
  image.grid.direction = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  image.grid.origin_mm = Eigen::Vector3d(0, 25, 0) -
                         image.grid.direction *
                             image.grid.spacing_mm.cwiseProduct((image.grid.size.cast<double>().array() - 1).matrix()) /
                             2;
  image.voxels.resize(image.grid.count());
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 8);
  for (int k = 0; k < 44; ++k)
    for (int j = 0; j < 104; ++j)
      for (int i = 0; i < 132; ++i) {
        const Eigen::Vector3d p = image.grid.point(Eigen::Vector3d(i, j, k));
        const double grey = (chest(p) < 1 ? 200 : in_body(p) ? 800 : 0) * std::exp(-0.003 * (p.y() + 30));
        image.at(i, j, k) = static_cast<float>(std::hypot(grey + noise(random), noise(random)));
      }
  return image;
}

Recipe recipe(const char* name) {
  return read_recipe_file(fs::path(SUPINE_SOURCE_DIR) / "segmentation" / "recipes" / name);
}

double share_of(const LabelImage& labels, double back_y) {
  double both = 0, found = 0, truth = 0;
  for (int k = 2; k < labels.grid.size.z() - 2; ++k)
    for (int j = 0; j < labels.grid.size.y(); ++j)
      for (int i = 0; i < labels.grid.size.x(); ++i) {
        const Eigen::Vector3d p = labels.grid.point(Eigen::Vector3d(i, j, k));
        if (p.y() > back_y || std::abs(p.z()) > 50) continue;  // between the folds
        const bool a = is_meshed(static_cast<Tissue>(labels.at(i, j, k))), b = in_body(p) && chest(p) >= 1;
        both += a && b;
        found += a;
        truth += b;
      }
  return 2 * both / (found + truth);
}

TEST(AutomaticT1, FindsBreastsChestAndPlanesOfATorso) {
  for (const double turn : {0.1}) {  // oblique
    Recipe steps = recipe("t1_auto.toml");
    for (Step& step : steps.steps)
      if (auto* planes = std::get_if<Planes>(&step)) planes->ends = Planes::Ends::anatomy;
    const auto result = run_recipe(torso(turn), steps);
    ASSERT_EQ(result.walls.size(), 1u);
    EXPECT_TRUE(result.doubts.empty()) << result.doubts.front().what;
    for (const CutPlane& plane : result.planes) {
      if (plane.name == "sternum") {
        EXPECT_NEAR(plane.at_mm, 0, 2.6);
      }
      if (plane.name == "mid_axillary") {  // between 99 % of the ellipse's half width and its widest place
        EXPECT_GT(plane.at_mm, front_y + half_depth * (1 - std::sqrt(1 - 0.99 * 0.99)) - 2.6);
        EXPECT_LT(plane.at_mm, front_y + half_depth + 2.6);
      }
    }
    double squares = 0;
    int count = 0;
    const ChestWall& wall = result.walls[0];
    for (Eigen::Index k = 2; k + 2 < wall.radius_mm.cols(); ++k)
      for (Eigen::Index a = 20; a + 20 < wall.radius_mm.rows(); ++a, ++count)
        squares += std::pow((std::sqrt(chest(wall.point(a, k))) - 1) * half_depth, 2);
    EXPECT_LT(std::sqrt(squares / count), 1.3);  // half a voxel
    EXPECT_GT(share_of(result.labels, front_y + 40), 0.98);
    EXPECT_TRUE(find_leaks(wall, front_y + 45).empty());
    EXPECT_EQ(count_components(result.labels).meshed, 1u);
  }
}

TEST(AutomaticT1, WarnsWhereTheImageShowsNoMuscleBorder) {
  GreyImage image = torso(0);
  for (int k = 0; k < 44; ++k)  // a wedge of the chest as bright as fat
    for (int j = 0; j < 104; ++j)
      for (int i = 0; i < 132; ++i) {
        const Eigen::Vector3d p = image.grid.point(Eigen::Vector3d(i, j, k));
        const double angle = std::atan2(p.x(), front_y + 78 - p.y());  // along the rays the wall is looked for on
        if (std::abs(angle - 0.7) < 0.35 && std::abs(p.z()) < 35 && chest(p) < 1) image.at(i, j, k) *= 4;
      }
  const auto result = run_recipe(image, recipe("t1_auto.toml"));
  const auto leaks = find_leaks(result.walls.at(0), front_y + 45);
  ASSERT_FALSE(leaks.empty());
  EXPECT_NEAR(std::atan2(leaks[0].middle_mm.x(), front_y + 78 - leaks[0].middle_mm.y()), 0.7, 0.2);
  EXPECT_NEAR(leaks[0].middle_mm.z(), 0, 15);
  EXPECT_NE(describe(leaks[0]).find("may leak"), std::string::npos);
}

TEST(AutomaticT1, PlanesCanBePlacedByHandAndOneSideChosen) {
  Recipe steps = recipe("t1_auto.toml");
  for (Step& step : steps.steps)
    if (auto* planes = std::get_if<Planes>(&step)) {
      planes->mid_axillary.at_mm = 40;
      planes->superior.offset_mm = -30;
      planes->side = Planes::Side::left;
    }
  const auto result = run_recipe(torso(0), steps);
  for (int k = 0; k < 44; ++k)
    for (int j = 0; j < 104; ++j)
      for (int i = 0; i < 132; ++i) {
        if (!is_meshed(static_cast<Tissue>(result.labels.at(i, j, k)))) continue;
        const Eigen::Vector3d p = result.labels.grid.point(Eigen::Vector3d(i, j, k));
        ASSERT_LE(p.y(), 40);
        ASSERT_GE(p.x(), -3);  // half a voxel and what the cleft is off
        ASSERT_LE(p.z(), 58);
      }
}

TEST(AutomaticT1, ReadersEndTheBreastWhereTheChestTurnsAndBelowTheFold) {
  const auto result = run_recipe(torso(0), read_shipped_recipe("t1_auto"));
  // Half way round an ellipse of half axes a, b the depth from its middle is b^2 / sqrt(a^2 + b^2).
  const double turn_y = front_y + half_depth - half_depth * half_depth / std::hypot(half_width, half_depth);
  const auto at = [&result](const std::string& name) -> double {
    for (const CutPlane& plane : result.planes)
      if (plane.name == name) return plane.at_mm;
    return NAN;
  };
  EXPECT_NEAR(at("mid_axillary"), turn_y, 6);
  EXPECT_EQ(at("inframammary_left"), at("inframammary_right"));
  EXPECT_LT(at("inframammary_left"), -60);
}

TEST(AutomaticT1, DenseGlandIsNotTakenForTheChest) {
  GreyImage image = torso(0);
  for (std::size_t n = 0; n < image.voxels.size(); ++n) {
    const Grid& grid = image.grid;
    const int i = static_cast<int>(n % 132), j = static_cast<int>(n / 132 % 104), k = static_cast<int>(n / 132 / 104);
    const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k));
    const double aside = std::hypot(std::abs(p.x()) - 75, p.z());
    if (aside < 38 && std::abs(p.y() + 15) < 35) image.voxels[n] *= 0.38f;  // most of either breast
  }
  const auto worst = [&image](double cost_per_mm) {
    Recipe steps = read_shipped_recipe("t1_auto");
    for (Step& step : steps.steps)
      if (auto* chest_step = std::get_if<Chest>(&step)) chest_step->options.ahead_cost_per_mm = cost_per_mm;
    const ChestWall wall = run_recipe(image, steps).walls.at(0);
    double most = 0;
    for (Eigen::Index k = 2; k + 2 < wall.radius_mm.cols(); ++k)
      for (Eigen::Index a = 40; a + 40 < wall.radius_mm.rows(); ++a)
        most = std::max(most, (std::sqrt(chest(wall.point(a, k))) - 1) * half_depth);
    return most;
  };
  EXPECT_LT(worst(ChestWallOptions().ahead_cost_per_mm), 6);
  EXPECT_GT(worst(0), 15);
}

/// How far in front of the chest a point lies, nearly, mm.
double ahead_of_chest(const Eigen::Vector3d& p) { return (std::sqrt(chest(p)) - 1) * half_depth; }

/// Fat and muscle equally bright with a thin dark line between; on her left another line in the fat in its place.
TEST(AutomaticFatSuppressed, ALineOnOneSideAloneIsNotTheChest) {
  GreyImage image = torso(0);
  Mask body;
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 3);
  for (int k = 0; k < image.grid.size.z(); ++k)
    for (int j = 0; j < image.grid.size.y(); ++j)
      for (int i = 0; i < image.grid.size.x(); ++i) {
        const Eigen::Vector3d p = image.grid.point(Eigen::Vector3d(i, j, k));
        const double ahead = ahead_of_chest(p);
        const bool inside = ahead < 0 || in_body(p);
        const bool elsewhere = p.x() > 25 && p.x() < 95 && p.z() > -20;
        const bool line = std::abs(elsewhere ? ahead - 16 : ahead) < 1.6;
        body.push_back(inside);
        const float grey = !inside ? 0 : line ? 60 : 100;
        image.at(i, j, k) = std::abs(grey + noise(random));
      }
  ChestWallOptions options;
  for (const Step& step : recipe("fatsat_auto.toml").steps)
    if (const auto* chest_step = std::get_if<Chest>(&step)) options = chest_step->options;
  const ChestWall wall = find_chest_wall(image, body, find_torso(front_skin(body, image.grid)), options);
  double worst = 0;
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a) {
      const Eigen::Vector3d p = wall.point(a, k);
      if (p.x() > 30 && p.x() < 85 && std::abs(p.z()) < 45 && p.y() < 70) worst = std::max(worst, ahead_of_chest(p));
    }
  EXPECT_LT(worst, 5);
}

TEST(AutomaticT1, TheCasesSideHoldsWhereTheRecipeNamesNone) {
  Recipe left = read_shipped_recipe("t1_auto");
  left.set_side(Planes::Side::left);
  const auto result = run_recipe(torso(0), left);
  double meshed = 0, of_the_right = 0;
  for (int k = 0; k < 44; ++k)
    for (int j = 0; j < 104; ++j)
      for (int i = 0; i < 132; ++i) {
        if (!is_meshed(static_cast<Tissue>(result.labels.at(i, j, k)))) continue;
        ++meshed;
        of_the_right += result.labels.grid.point(Eigen::Vector3d(i, j, k)).x() < -3;
      }
  EXPECT_GT(meshed, 1000);
  EXPECT_EQ(of_the_right, 0);
}

TEST(AutomaticT1, RefusesAVolumeWithoutTwoBreasts) {
  GreyImage image = torso(0);
  for (int k = 0; k < 44; ++k)
    for (int j = 0; j < 104; ++j)
      for (int i = 0; i < 132; ++i)
        if (image.grid.point(Eigen::Vector3d(i, j, k)).y() < 13) image.at(i, j, k) = 5;
  const std::string message = testing::message_of([&] { run_recipe(image, recipe("t1_auto.toml")); });
  EXPECT_NE(message.find("levels of the volume show a cleft between two breasts"), std::string::npos) << message;
}

TEST(AutomaticT1, BorderOfARealPatientPartsDarkFromBright) {
  const char* folder = std::getenv("SUPINE_SHARED_DATA");
  const fs::path file = fs::path(folder ? folder : SUPINE_SHARED_DATA) / "mri-noncommercial" / "duke153_t1tse.nrrd";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not there";
  const GreyImage image = read_image(file, "").image;
  const auto result = run_recipe(image, recipe("t1_auto.toml"));
  const ChestWall& wall = result.walls.at(0);
  int clear = 0, count = 0;
  for (Eigen::Index k = 5; k + 5 < wall.radius_mm.cols(); ++k)
    for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a) {
      const Eigen::Vector3d p = wall.point(a, k);
      if (p.y() > 75) continue;
      const float out = sample(image, p + 3 * wall.direction(a)), in = sample(image, p - 3 * wall.direction(a));
      clear += out > 1.5f * in;  // in the file's own greys, shading and all
      ++count;
    }
  EXPECT_GT(clear, 0.9 * count);
  EXPECT_EQ(count_components(result.labels).meshed, 1u);
}

}  // namespace
}  // namespace supine::segmentation
