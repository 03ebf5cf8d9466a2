// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/transform_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/error.h"
#include "tests/calibration/shapes.h"

namespace supine::registration {
namespace {

namespace fs = std::filesystem;

class TransformFile : public ::testing::Test {
 protected:
  fs::path file_ = fs::path(::testing::TempDir()) /
                   (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".tfm");
  const RigidTransform moved_{testing::some_rotation(), {12.5, -200, 31}};

  void write(const std::string& text) const { std::ofstream(file_) << text; }

  std::string complaint() const {
    try {
      read_tfm(file_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

/// Numbers after @p key, read without the reader under test.
std::vector<double> numbers(const fs::path& file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(key, 0) != 0) continue;
    std::istringstream stream(line.substr(key.size()));
    std::vector<double> values;
    for (double value; stream >> value;) values.push_back(value);
    return values;
  }
  return {};
}

TEST_F(TransformFile, MapsPointsOfTheImageToTheScanAsItkDefinesIt) {
  const Eigen::Vector3d centre(5, -60, 8);
  write_tfm(moved_, centre, file_);
  const std::vector<double> p = numbers(file_, "Parameters:"), c = numbers(file_, "FixedParameters:");
  ASSERT_EQ(p.size(), 12u);
  ASSERT_EQ(c.size(), 3u);
  const Points scan = testing::random_points(20, -100, 100, 3);
  const Points image = moved_.apply(scan);
  for (Eigen::Index i = 0; i < scan.rows(); ++i)
    for (int row = 0; row < 3; ++row) {
      double value = p[9 + row] + c[row];  // ITK: y = A (x − c) + t + c, A by rows
      for (int column = 0; column < 3; ++column) value += p[3 * row + column] * (image(i, column) - c[column]);
      EXPECT_NEAR(value, scan(i, row), 1e-9);
    }
}

TEST_F(TransformFile, ReadsBackWhatItWrote) {
  write_tfm(moved_, {5, -60, 8}, file_);
  const RigidTransform read = read_tfm(file_);
  const Points points = testing::random_points(20, -100, 100, 4);
  EXPECT_LT((read.apply(points) - moved_.apply(points)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_F(TransformFile, ReadsEulerAnglesInTheOrderOfItk) {
  write(
      "#Insight Transform File V1.0\n#Transform 0\nTransform: Euler3DTransform_double_3_3\n"
      "Parameters: 0.1 0.2 0.3 1 2 3\nFixedParameters: 0 0 0 0\n");
  const double a = 0.1, b = 0.2, g = 0.3;
  Eigen::Matrix3d x, y, z;
  x << 1, 0, 0, 0, std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a);
  y << std::cos(b), 0, std::sin(b), 0, 1, 0, -std::sin(b), 0, std::cos(b);
  z << std::cos(g), -std::sin(g), 0, std::sin(g), std::cos(g), 0, 0, 0, 1;
  const RigidTransform image_to_scan = read_tfm(file_).inverse();
  EXPECT_LT((image_to_scan.rotation - z * x * y).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((image_to_scan.shift - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST_F(TransformFile, RefusesWhatNamesNoFrameOrIsNotRigid) {
  write("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_NE(complaint().find("neither its frame nor its sense is known"), std::string::npos) << complaint();
  const std::string head = "#Insight Transform File V1.0\nTransform: AffineTransform_double_3_3\n";
  write(head + "Parameters: 2 0 0 0 2 0 0 0 2 0 0 0\nFixedParameters: 0 0 0\n");
  EXPECT_NE(complaint().find("not rigid"), std::string::npos) << complaint();
  write(head + "Parameters: -1 0 0 0 1 0 0 0 1 0 0 0\nFixedParameters: 0 0 0\n");
  EXPECT_NE(complaint().find("mirrors"), std::string::npos) << complaint();
  write(head + "Parameters: 1 0 0 0 1 0 0 0 1\nFixedParameters: 0 0 0\n");
  EXPECT_NE(complaint().find("9 parameters, not 12"), std::string::npos) << complaint();
  write("#Insight Transform File V1.0\nTransform: BSplineTransform_double_3_3\nParameters: 1\nFixedParameters: 0\n");
  EXPECT_NE(complaint().find("BSplineTransform"), std::string::npos) << complaint();
  fs::remove(file_);
  EXPECT_NE(complaint().find("cannot be read"), std::string::npos) << complaint();
}

}  // namespace
}  // namespace supine::registration
