// SPDX-License-Identifier: AGPL-3.0-or-later
// supine-tetrahedralise as a user runs it: exit codes, files, messages.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <Eigen/LU>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "meshing/mesh_io.h"
#include "reconstruction/surface_io.h"
#include "segmentation/formats/labels_io.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

namespace fs = std::filesystem;

class TetrahedraliseTool : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(tool())) GTEST_SKIP() << tool() << " is not built";
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("supine_tetrahedralise_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const auto dome = testing::dome_mesh({.rings = 7, .layers = 2});
    reconstruction::write_surface(testing::boundary_surface(dome), folder_ / "coarse.vtp");
    reconstruction::write_surface(dome.muscle, folder_ / "muscle.vtp");
    segmentation::write_labels(labels_of(dome), folder_ / "labels.vti", {{"side", "right"}});
  }
  void TearDown() override { fs::remove_all(folder_); }

  static fs::path tool() { return fs::path(SUPINE_BIN_DIR) / "supine-tetrahedralise"; }

  // Adipose in every voxel whose middle lies in a cell.
  static segmentation::LabelImage labels_of(const meshing::TetMesh& mesh) {
    const Points& points = mesh.points;
    segmentation::LabelImage image;
    image.grid.spacing_mm.setConstant(3);
    image.grid.origin_mm = points.colwise().minCoeff().transpose().array() - 6;
    image.grid.size =
        ((points.colwise().maxCoeff() - points.colwise().minCoeff()).array() / 3 + 6).cast<int>().transpose();
    image.voxels.assign(image.grid.count(), static_cast<std::uint8_t>(segmentation::Tissue::air));
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) paint(points(mesh.cells.row(c).head(4), Eigen::all), image);
    return image;
  }

  static void paint(const Eigen::Matrix<double, 4, 3>& corners, segmentation::LabelImage& image) {
    Eigen::Matrix4d from;
    from << corners.transpose(), Eigen::RowVector4d::Ones();
    const Eigen::Matrix4d barycentric = from.inverse();
    const segmentation::Grid& grid = image.grid;
    const Eigen::Vector3i low = grid.continuous_index(corners.colwise().minCoeff().transpose()).cast<int>(),
                          high = grid.continuous_index(corners.colwise().maxCoeff().transpose()).cast<int>();
    for (int k = low.z(); k <= high.z() + 1; ++k)
      for (int j = low.y(); j <= high.y() + 1; ++j)
        for (int i = low.x(); i <= high.x() + 1; ++i)
          if ((barycentric * grid.point(Eigen::Vector3d(i, j, k)).homogeneous()).minCoeff() >= 0)
            image.voxels[grid.index(i, j, k)] = static_cast<std::uint8_t>(segmentation::Tissue::adipose);
  }

  int run(const std::string& arguments) const {
    const std::string command =
        "cd '" + folder_.string() + "' && '" + tool().string() + "' " + arguments + " > out.txt 2> err.txt";
    return WEXITSTATUS(std::system(command.c_str()));
  }

  std::string text(const std::string& name) const {
    std::ifstream in(folder_ / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  fs::path folder_;
};

TEST_F(TetrahedraliseTool, WritesAMeshWithRingAndFigures) {
  ASSERT_EQ(run("coarse.vtp muscle.vtp labels.vti"), 0) << text("err.txt");
  const auto mesh = meshing::read_mesh(folder_ / "mesh.vtu");
  EXPECT_EQ(meshing::read_side(folder_ / "mesh.vtu"), "right");
  EXPECT_GT((mesh.region.array() == 3).count(), 20);
  const auto figures = nlohmann::json::parse(text("mesh.json"));
  EXPECT_EQ(figures["cells"], mesh.cells.rows());
  EXPECT_EQ(figures["inverted"], 0);
  EXPECT_NEAR(figures["anatomy"]["foot_radius_mm"], 64, 0.08 * 64);  // the dome has edges of 11 mm
  EXPECT_EQ(figures["anatomy"]["side"], "right");
  EXPECT_NEAR(figures["volumes_ml"]["mesh"]["adipose"], figures["volume_ml"], 1e-6);
}

TEST_F(TetrahedraliseTool, OptionsWork) {
  ASSERT_EQ(run("coarse.vtp muscle.vtp labels.vti --order 2 --cells 8000 --side right -o fine.vtu"), 0)
      << text("err.txt");
  const auto mesh = meshing::read_mesh(folder_ / "fine.vtu");
  EXPECT_EQ(mesh.order(), 2);
  EXPECT_NEAR(static_cast<double>(mesh.cells.rows()), 8000, 2000);
  EXPECT_EQ(meshing::read_side(folder_ / "fine.vtu"), "right");
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti --side left -o other.vtu"), 2) << "the labels say right";
}

TEST_F(TetrahedraliseTool, CheckReportsAndWritesNothing) {
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti --check"), 0) << text("err.txt");
  EXPECT_FALSE(fs::exists(folder_ / "mesh.vtu"));
  EXPECT_NE(text("out.txt").find("smallest angle: tetrahedron"), std::string::npos);
  ASSERT_EQ(run("coarse.vtp muscle.vtp labels.vti"), 0);
  EXPECT_EQ(run("--check mesh.vtu -o report.json"), 0) << text("err.txt");
  const auto mesh = nlohmann::json::parse(text("mesh.json")), report = nlohmann::json::parse(text("report.json"));
  for (const char* key : {"cells", "smallest_dihedral_histogram_10deg", "radius_ratio_histogram_tenths"})
    EXPECT_EQ(report[key], mesh[key]) << key;
  ASSERT_EQ(report["worst_place_mm"].size(), 3u);
  EXPECT_EQ(run("--check mesh.vtu -o report.vtu"), 2);
}

TEST_F(TetrahedraliseTool, InterfaceBecomesPureTissue) {
  auto gland = testing::boundary_surface(testing::box_mesh(2, 2, 2, {12, 12, 12}));
  gland.points.rowwise() += Eigen::RowVector3d(-6, -34, -6);
  reconstruction::write_surface(gland, folder_ / "gland.vtp");
  ASSERT_EQ(run("coarse.vtp muscle.vtp labels.vti --interface gland=gland.vtp"), 0) << text("err.txt");
  EXPECT_NEAR(nlohmann::json::parse(text("mesh.json"))["volumes_ml"]["mesh"]["gland"], 1.728, 1e-6);
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti --force --interface gland.vtp"), 2);
  EXPECT_NE(text("err.txt").find("TISSUE=FILE"), std::string::npos) << text("err.txt");
  gland.points.rowwise() += Eigen::RowVector3d(0, -30, 0);
  reconstruction::write_surface(gland, folder_ / "gland.vtp");
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti --force --interface gland=gland.vtp"), 2);
  EXPECT_NE(text("err.txt").find("gland.vtp"), std::string::npos) << text("err.txt");
}

TEST_F(TetrahedraliseTool, TooFewCellsIsTargetNotMet) {
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti --cells 100"), 1);
  EXPECT_TRUE(fs::exists(folder_ / "mesh.vtu"));
  EXPECT_NE(text("err.txt").find("instead of 100"), std::string::npos) << text("err.txt");
}

TEST_F(TetrahedraliseTool, RefusesAnOpenSurfaceAndWritesNothing) {
  auto surface = reconstruction::read_surface(folder_ / "coarse.vtp");
  surface.triangles.conservativeResize(surface.triangles.rows() - 1, 3);
  surface.region.conservativeResize(surface.triangles.rows());
  reconstruction::write_surface(surface, folder_ / "open.vtp");
  EXPECT_EQ(run("open.vtp muscle.vtp labels.vti"), 2);
  EXPECT_FALSE(fs::exists(folder_ / "mesh.vtu"));
  EXPECT_FALSE(fs::exists(folder_ / "mesh.json"));
  EXPECT_NE(text("err.txt").find("open.vtp"), std::string::npos) << text("err.txt");
}

TEST_F(TetrahedraliseTool, DoesNotReplaceAFileUnasked) {
  ASSERT_EQ(run("coarse.vtp muscle.vtp labels.vti"), 0);
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti"), 2);
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti --force"), 0);
}

TEST_F(TetrahedraliseTool, BadUsageIsExitCodeTwo) {
  EXPECT_EQ(run("coarse.vtp muscle.vtp labels.vti --side up"), 2);
  EXPECT_EQ(run("coarse.vtp"), 2);
  EXPECT_EQ(run("none.vtp muscle.vtp labels.vti"), 2);
}

}  // namespace
}  // namespace supine
