// SPDX-License-Identifier: AGPL-3.0-or-later
// The built supine-warp on a box of 40 mm that moves.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/landmarks.h"
#include "meshing/mesh_io.h"
#include "segmentation/formats/image_io.h"
#include "segmentation/formats/labels_io.h"
#include "segmentation/formats/vector_io.h"
#include "tests/pipeline/process.h"
#include "tests/pipeline/temporary_folder.h"
#include "tests/warp/two_shapes.h"
#include "warp/point_file.h"

namespace supine::warp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using pipeline::Finished;
using pipeline::read_text;
using pipeline::write_text;

double grey(const Eigen::Vector3d& p) {
  return p.minCoeff() > 0 && p.maxCoeff() < 40 ? 300 + std::round(2 * p.x() + 3 * p.z()) : 5;
}

class WarpTool : public ::testing::Test {
 protected:
  void SetUp() override {
    const testing::MovedBox box = testing::moved_box(1, testing::affine);
    fs::create_directories(out_);
    meshing::write_pose(box.mesh, box.mesh.points, {}, {}, out_ / "prone.vtu", "left");
    meshing::write_pose(box.mesh, box.target, {}, {}, out_ / "supine.vtu", "left");
    const auto grid = testing::grid_over({-25, -25, -25}, 90, 2.5);
    segmentation::write_image(testing::volume_of(grid, grey), case_ / "mri.nrrd");
    segmentation::LabelImage labels{grid, {}};
    for (const float v : testing::volume_of(grid, grey).voxels) labels.voxels.push_back(v > 100 ? 1 : 0);
    segmentation::write_labels(labels, out_ / "labels.vti");
    write_text(case_ / "prone_landmarks.csv", "name,x,y,z\nclip,20,15,25\nnipple,20,20,40\n");
    write_text(
        case_ / "case.toml",
        "[case]\nname = \"box\"\nside = \"left\"\n[image]\nfile = \"mri.nrrd\"\nkind = \"mri\"\n"
        "[[segmentation.step]]\ndo = \"noise_floor\"\n"
        "[pose.prone]\ngravity = [0, -1, 0]\n[pose.supine]\ngravity = [0, 1, 0]\n[pose.upright]\ngravity = [0, 0, -1]\n"
        "[landmarks]\nprone = \"prone_landmarks.csv\"\n");
  }

  Finished run(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {pipeline::tool("warp"), case_.string()};
    words.insert(words.end(), more.begin(), more.end());
    return pipeline::run_process(words);
  }

  /// Refused with all of @p parts in the message and nothing written.
  void expect_refused(const std::vector<std::string>& more, const std::vector<std::string>& parts) const {
    const Finished finished = run(more);
    EXPECT_EQ(finished.code, 2) << finished.err;
    for (const std::string& part : parts) EXPECT_NE(finished.err.find(part), std::string::npos) << finished.err;
    EXPECT_EQ(pipeline::files_in(warped_), std::vector<std::string>{});
  }

  pipeline::TemporaryFolder folder_;
  fs::path case_ = folder_ / "case", out_ = case_ / "out", warped_ = out_ / "warp";
};

TEST_F(WarpTool, CarriesImageLabelsAndLandmarksOfTheCase) {
  const Finished finished = run();
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(finished.err, "");
  const auto mri = segmentation::read_image(warped_ / "supine_mri.nrrd", "").image;
  const auto labels = segmentation::read_image(warped_ / "supine_labels.nrrd", "").image;
  for (const Eigen::Vector3d& from : std::vector<Eigen::Vector3d>{{20, 20, 20}, {8, 30, 12}, {33, 9, 31}}) {
    const Eigen::Vector3i at = mri.grid.continuous_index(testing::affine(from)).array().round().cast<int>();
    const Eigen::Vector3d there = testing::affine_back(mri.grid.point(at.cast<double>()));
    EXPECT_NEAR(mri.at(at.x(), at.y(), at.z()), 300 + 2 * there.x() + 3 * there.z(), 1);
    EXPECT_EQ(labels.at(at.x(), at.y(), at.z()), 1);
  }
  const Landmarks landmarks = read_landmarks(warped_ / "supine_landmarks.csv");
  EXPECT_LT((landmarks.points.row(0).transpose() - testing::affine({20, 15, 25})).norm(), 2e-3);
  const Json figures = Json::parse(read_text(warped_ / "supine_mri.json"));
  EXPECT_NEAR(figures["body_ml"].get<double>(), 64 * 1.1 * 0.9 * 1.05, 1);
  EXPECT_GT(figures["skin_contrast"].get<double>(), 0.95);
  EXPECT_EQ(figures["overlapping_voxels"], 0);
  for (const char* name :
       {"supine_from_prone.tfm", "supine_from_prone_displacement.nrrd", "supine_from_prone_displacement.nii.gz"})
    EXPECT_GT(fs::file_size(warped_ / name), 1000u) << name;
  EXPECT_LT(Json::parse(read_text(warped_ / "supine_from_prone.json"))["grid_error_max_mm"].get<double>(), 1e-3);
}

TEST_F(WarpTool, ThreadsChangeNoByte) {
  for (const char* threads : {"1", "3"})
    ASSERT_EQ(run({"-o", (folder_ / threads).string(), "--threads", threads, "--grid-mm", "4"}).code, 0);
  for (const char* name : {"supine_mri.nrrd", "supine_from_prone.tfm", "supine_landmarks.csv"})
    EXPECT_EQ(read_text(folder_ / "1" / name), read_text(folder_ / "3" / name)) << name;
}

TEST_F(WarpTool, BringsAVolumeBackOntoTheGridOfAnother) {
  ASSERT_EQ(run({(case_ / "mri.nrrd").string(), "--no-transform", "--interpolation", "bspline"}).code, 0);
  const std::string supine = (warped_ / "supine_mri.nrrd").string();
  const Finished back = run({supine, "--from", "supine", "--to", "prone", "--like", (case_ / "mri.nrrd").string(),
                             "--no-transform", "--interpolation", "bspline"});
  ASSERT_EQ(back.code, 0) << back.err;
  const auto first = segmentation::read_image(case_ / "mri.nrrd", "").image;
  const auto again = segmentation::read_image(warped_ / "prone_supine_mri.nrrd", "").image;
  ASSERT_EQ(again.grid.size, first.grid.size);
  for (std::size_t n = 0; n < first.voxels.size(); ++n) {
    const int row = first.grid.size.x(), slice = row * first.grid.size.y(), i = static_cast<int>(n);
    const Eigen::Vector3d p = first.grid.point(Eigen::Vector3d(i % row, i % slice / row, i / slice));
    // A cubic spline rings beside the skin's step of 300, a quarter of it from voxel to voxel.
    if (p.minCoeff() < 13 || p.maxCoeff() > 27) continue;
    ASSERT_NEAR(again.voxels[n], first.voxels[n], 2) << p.transpose();
  }
}

TEST_F(WarpTool, CarriesSlicersFilesAndTellsWhatStays) {
  write_text(case_ / "plan.mrk.json",
             R"({"markups": [{"type": "Curve", "coordinateSystem": "RAS", "controlPoints": [
             {"label": "a", "position": [-10, -10, 10]}, {"label": "b", "position": [-30, -25, 20]},
             {"label": "far", "position": [-100, -25, 20]}]}]})");
  const Finished finished = run({"--points", (case_ / "plan.mrk.json").string()});
  EXPECT_EQ(finished.code, 1) << "one point stays";
  EXPECT_NE(finished.err.find("'far' lies 60.0 mm outside"), std::string::npos) << finished.err;
  const PointFile carried(warped_ / "supine_plan.mrk.json", "LPS");
  EXPECT_EQ(carried.frame(), "RAS");
  EXPECT_LT((carried.points().row(0).transpose() - testing::affine({10, 10, 10})).norm(), 1e-6);
  EXPECT_EQ(carried.points().row(2), Eigen::RowVector3d(100, 25, 20));
  const Json figures = Json::parse(read_text(warped_ / "supine_plan_points.json"));
  EXPECT_EQ(figures["points"][2]["carried"], false);
  EXPECT_LT(figures["curves"][0]["between_points_mm"].get<double>(), 1e-6) << "a straight motion bends no line";
}

TEST_F(WarpTool, RefusesWhatCannotBeRight) {
  const std::string mri = (case_ / "mri.nrrd").string();
  expect_refused({"--pose", "upright"}, {"upright.vtu is not there", "simulate"});
  expect_refused({"--pose", "sideways"}, {"sideways", "prone"});
  expect_refused({"--pose", "prone"}, {"nothing would move"});
  expect_refused({"--from", "supine", "--to", "prone"}, {"name the volume that shows supine"});
  expect_refused({mri, "--spacing", "0.001"}, {"GB", "--spacing"});
  expect_refused({mri, "--spacing", "1", "2"}, {"one number, or three"});
  expect_refused({mri, "--labels", mri}, {"the same name"});
  const auto elsewhere = [&](const Eigen::Vector3d& low, const char* name) {
    segmentation::write_image(testing::volume_of(testing::grid_over(low, 60, 2.5), [](const auto& p) { return p.x(); }),
                              case_ / name);
    return (case_ / name).string();
  };
  expect_refused({elsewhere({200, 0, 0}, "other.nrrd")}, {"holds 0 % of the body", "Another patient"});
  expect_refused({elsewhere({-50, -50, -10}, "ras.nrrd")}, {"x and y negated", "RAS"});
  write_text(case_ / "out.csv", "name,x,y,z\na,-20,-20,20\n");
  expect_refused({"--points", (case_ / "out.csv").string()}, {"every point lies outside", "RAS"});
}

TEST_F(WarpTool, TakesNoVolumeThatShowsAnotherBody) {
  const auto shifted = testing::volume_of(testing::grid_over({-25, -25, -25}, 90, 2.5),
                                          [](const auto& p) { return grey(p + Eigen::Vector3d(25, 25, 20)); });
  segmentation::write_image(shifted, case_ / "other.nrrd");
  const std::string other = (case_ / "other.nrrd").string();
  expect_refused({other, "--no-transform"}, {"other.nrrd does not show the skin", "bound 65 %", "--trust-place"});
  const Finished trusted = run({other, "--no-transform", "--trust-place"});
  EXPECT_EQ(trusted.code, 0);
  EXPECT_NE(trusted.err.find("does not show the skin"), std::string::npos) << trusted.err;
}

TEST_F(WarpTool, CarriesAPartOfTheBodyWhenToldTo) {
  const auto part = testing::volume_of(testing::grid_over({0, 0, 0}, 20, 2.5), [](const auto& p) { return grey(p); });
  segmentation::write_image(part, case_ / "ultrasound.nrrd");
  const std::string ultrasound = (case_ / "ultrasound.nrrd").string();
  expect_refused({ultrasound, "--no-transform"}, {"ultrasound.nrrd: holds", "bound 50 %", "--trust-place"});
  const Finished trusted = run({ultrasound, "--no-transform", "--trust-place"});
  EXPECT_EQ(trusted.code, 0) << trusted.err;
  EXPECT_NE(trusted.err.find("the rest becomes background"), std::string::npos) << trusted.err;
}

}  // namespace
}  // namespace supine::warp
