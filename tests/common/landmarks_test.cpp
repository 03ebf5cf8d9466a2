// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/landmarks.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/error.h"

namespace supine {
namespace {

namespace fs = std::filesystem;

class LandmarksTest : public ::testing::Test {
 protected:
  fs::path write(const std::string& text) const {
    const fs::path file = fs::temp_directory_path() / ("landmarks_" + std::to_string(getpid()) + ".csv");
    std::ofstream(file) << text;
    return file;
  }
  void expect_refused(const std::string& text, const std::string& word) const {
    try {
      read_landmarks(write(text));
      FAIL() << "accepted: " << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
};

TEST_F(LandmarksTest, ReadsAndWritesTheSame) {
  const Landmarks landmarks = read_landmarks(write("name,x,y,z\nnipple,-7.879,-62.282,0.033\r\nupper,1,2,3e1\n"));
  ASSERT_EQ(landmarks.names, (std::vector<std::string>{"nipple", "upper"}));
  EXPECT_EQ(landmarks.points(0, 1), -62.282);
  EXPECT_EQ(landmarks.points(1, 2), 30);
  const fs::path copy = write("");
  write_landmarks(landmarks, copy);
  EXPECT_EQ(read_landmarks(copy).points, landmarks.points);
}

TEST_F(LandmarksTest, NumbersMayHaveTheirSign) {
  EXPECT_EQ(read_landmarks(write("name,x,y,z\na,+1, +2.5,-3e+1\n")).points.row(0), Eigen::RowVector3d(1, 2.5, -30));
  expect_refused("name,x,y,z\na,+-1,2,3\n", "'+-1' is not a finite number");
}

TEST_F(LandmarksTest, SigmaIsReadAndWritten) {
  const Landmarks landmarks = read_landmarks(write("name,x,y,z,sigma_mm\nnipple,1,2,3,1.5\nupper,4,5,6,0.25\n"));
  EXPECT_EQ(landmarks.sigma_mm, Eigen::Vector2d(1.5, 0.25));
  const fs::path copy = write("");
  write_landmarks(landmarks, copy);
  EXPECT_EQ(read_landmarks(copy).sigma_mm, landmarks.sigma_mm);
  EXPECT_EQ(read_landmarks(write("name,x,y,z\nnipple,1,2,3\n")).sigma_mm.size(), 0);
}

TEST_F(LandmarksTest, RasIsTurnedToLps) {
  const Landmarks landmarks = read_landmarks(write("name,x,y,z\na,1,2,3\n"), "RAS");
  EXPECT_EQ(landmarks.points.row(0), Eigen::RowVector3d(-1, -2, 3));
}

TEST_F(LandmarksTest, BadFilesAreRefusedWithTheLine) {
  expect_refused("x,y,z\n1,2,3\n", ":1");
  expect_refused("name,x,y,z\n", "holds no landmark");
  expect_refused("name,x,y,z\n ,1,2,3\n", "no name");
  expect_refused("name,x,y,z\na,.01,.02,.03\nb,.02,.01,.03\nc,.05,.02,.07\n", "metres");
  expect_refused("name,x,y,z\na,1,2\n", ":2");
  expect_refused("name,x,y,z\na,1,2,three\n", "three");
  expect_refused("name,x,y,z\na,1,nan,3\n", "nan");
  expect_refused("name,x,y,z\na,1,2,3\na,4,5,6\n", "twice");
  expect_refused("name,x,y,z,sigma\na,1,2,3,1\n", "name,x,y,z,sigma_mm");
  expect_refused("name,x,y,z,sigma_mm\na,1,2,3,1\nb,1,2,3\n", ":3: 4 fields, 5 expected");
  expect_refused("name,x,y,z,sigma_mm\na,1,2,3,0\n", ":2: sigma_mm is 0");
  expect_refused("name,x,y,z,sigma_mm\na,1,2,3,-1.5\n", ":2: sigma_mm is -1.5");
  expect_refused("name,x,y,z,sigma_mm\na,1,2,3,wide\n", "'wide'");
  EXPECT_THROW(read_landmarks("no-such-file.csv"), InputError);
}

}  // namespace
}  // namespace supine
