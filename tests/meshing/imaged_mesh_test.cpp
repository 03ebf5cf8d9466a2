// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/imaged_mesh.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/error.h"
#include "meshing/mesh_io.h"
#include "meshing/topology.h"
#include "tests/support/shapes.h"

namespace supine::meshing {
namespace {

namespace fs = std::filesystem;

class ImagedMesh : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    file_ = fs::temp_directory_path() / (std::string("supine_imaged_") + info->name() + ".vtu");
  }
  void TearDown() override { fs::remove(file_); }

  /// What is said of the file for a case of that side; empty: nothing.
  std::string complaint(const std::string& side = "left") const {
    try {
      read_imaged_mesh(file_, side);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  void expect_word(const std::string& message, const std::string& word) const {
    EXPECT_NE(message.find(word), std::string::npos) << message;
  }

  TetMesh mesh_ = testing::dome_mesh({.rings = 4, .layers = 2, .muscle_rings = 5});
  fs::path file_;
};

TEST_F(ImagedMesh, OfThisSideIsRead) {
  write_mesh(mesh_, file_, "left");
  EXPECT_EQ(read_imaged_mesh(file_, "left").points, mesh_.points);
  expect_word(complaint("right"), "side \"left\", the case says side = \"right\"");
}

TEST_F(ImagedMesh, TheImagedPoseIsOneAndAMovedOneIsNot) {
  write_pose(mesh_, mesh_.points, {}, {}, file_, "left");
  EXPECT_EQ(complaint(), "");
  Points moved = mesh_.points;
  moved.col(1).array() += 3;
  write_pose(mesh_, moved, {}, {}, file_, "left");
  expect_word(complaint(), "moved by up to 3.0 mm");
}

TEST_F(ImagedMesh, InCentimetresIsTooSmall) {
  mesh_.points /= 10;
  mesh_.muscle.points /= 10;
  write_mesh(mesh_, file_, "left");
  expect_word(complaint(), "ml (bound 10 to 10000)");
}

TEST_F(ImagedMesh, APieceThatNothingHoldsIsNamed) {
  const auto points = mesh_.points.rows(), cells = mesh_.cells.rows(), faces = mesh_.faces.rows();
  mesh_.points.conservativeResize(points + 4, 3);
  mesh_.points.bottomRows(4) << 300, 0, 0, 310, 0, 0, 300, 10, 0, 300, 0, 10;
  mesh_.cells.conservativeResize(cells + 1, 4);
  mesh_.cells.row(cells) << points, points + 1, points + 2, points + 3;
  mesh_.tissue.conservativeResize(cells + 1);
  mesh_.tissue[cells] = mesh_.tissue[0];
  mesh_.fraction.conservativeResize(cells + 1, mesh_.fraction.cols());
  mesh_.fraction.row(cells) = mesh_.fraction.row(0);
  mesh_.faces.conservativeResize(faces + 4, 3);
  mesh_.region.conservativeResize(faces + 4);
  for (int f = 0; f < 4; ++f) {
    for (int corner = 0; corner < 3; ++corner)
      mesh_.faces(faces + f, corner) = static_cast<int>(points) + tet_faces[static_cast<std::size_t>(f)][corner];
    mesh_.region[faces + f] = static_cast<int>(reconstruction::Region::skin);
  }
  set_face_cells(mesh_);
  write_mesh(mesh_, file_, "left");
  const std::string message = complaint();
  expect_word(message, "0.17 ml at (300.0, 0.0, 0.0) mm is attached to nothing");
}

}  // namespace
}  // namespace supine::meshing
