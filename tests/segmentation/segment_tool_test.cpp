// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "segmentation/formats/labels_io.h"
#include "segmentation/tissue.h"
#include "tests/segmentation/segment_fixture.h"

// The executable: exit codes, files, figures.
namespace supine::segmentation {
namespace {

using namespace testing;
namespace fs = std::filesystem;

class SegmentTool : public SegmentFixture {
 protected:
  void SetUp() override {
    SegmentFixture::SetUp();
    write_nrrd(folder_ / "labels.nrrd", image_);
    write_case("labels.nrrd", "labels", "");
  }
  void write_case(const std::string& file, const std::string& kind, const std::string& more) const {
    write_text(
        folder_ / "case.toml",
        fmt::format(
            "[case]\nname = \"t\"\nside = \"left\"\n[image]\nfile = \"{}\"\nkind = \"{}\"\n[image.labels]\nair = "
            "[0]\nadipose = [7]\n"
            "muscle = [40]\n[pose.prone]\ngravity = [0.0, -1.0, 0.0]\n[pose.supine]\ngravity = [0.0, 1.0, 0.0]\n{}",
            file, kind, more));
  }
  GreyImage image_ = block(0, 7, 40);
};

TEST_F(SegmentTool, MapsLabelsAndTellsVolumes) {
  ASSERT_EQ(run(), 0) << errors();
  const LabelImage labels = read_labels(folder_ / "out" / "labels.vti");
  EXPECT_EQ(labels.at(5, 5, 5), static_cast<std::uint8_t>(Tissue::adipose));
  EXPECT_EQ(labels.at(5, 8, 5), static_cast<std::uint8_t>(Tissue::muscle));
  const auto figures = nlohmann::json::parse(text_of(folder_ / "out" / "labels.json"));
  EXPECT_EQ(figures["voxels"]["adipose"], 384);
  EXPECT_NEAR(figures["volume_ml"]["adipose"].get<double>(), 3.072, 1e-12);
  EXPECT_EQ(figures["components"]["muscle"], 1);
  EXPECT_EQ(figures["grid"]["size"][2], 10);
  EXPECT_EQ(run(), 2);  // not overwritten without --force
  EXPECT_EQ(run("--force"), 0);
}

TEST_F(SegmentTool, KnowsItsRecipesByName) {
  write_nrrd(folder_ / "mri.nrrd", image_);
  write_case("mri.nrrd", "mri", "[segmentation]\nrecipe = \"t1_auot\"\n");
  expect_refused(run(), "did you mean t1_auto?");
  write_case("mri.nrrd", "mri", "[segmentation]\nrecipe = \"t1_auto\"\n");
  const int code = run();  // the recipe is found and run; the block is no chest
  expect_refused(code, "segmentation recipe, step");
  expect_refused(run("--recipe fatsat_atuo"), "fatsat_auto");
  EXPECT_EQ(run("--recipes"), 0);
}

TEST_F(SegmentTool, RunsARecipeAndComparesWithTheTruth) {
  GreyImage grey = image_;
  for (float& v : grey.voxels) v = v == 7 ? 100 : v == 40 ? 20 : 0;
  write_nrrd(folder_ / "mri.nrrd", grey);
  write_case("mri.nrrd", "mri", std::string(fat_step) + R"([[segmentation.step]]
do = "grow"
mask = "muscle"
seeds_mm = [[10, 16, 10]]
lower = 10
upper = 60
)" + paint_steps);
  ASSERT_EQ(run("--truth " + (folder_ / "labels.nrrd").string()), 0) << errors();
  const auto figures = nlohmann::json::parse(text_of(folder_ / "out" / "labels.json"));
  EXPECT_EQ(figures["dice_breast"], 1);
  EXPECT_EQ(figures["dice"]["muscle"], 1);
  EXPECT_EQ(figures["recipe"].size(), 4u);
}

/// Takes the name of the frame out of an NRRD file.
void forget_frame(const fs::path& file) {
  std::string text = text_of(file);
  const std::string named = "space: left-posterior-superior";
  write_text(file, text.replace(text.find(named), named.size(), "space dimension: 3"));
}

TEST_F(SegmentTool, TurnsAVolumeWhoseHeaderNamesNoFrame) {
  forget_frame(folder_ / "labels.nrrd");
  write_case("labels.nrrd", "labels\"\nframe = \"ALS", "");
  ASSERT_EQ(run(), 0) << errors();
  EXPECT_EQ(errors().find("frame"), std::string::npos) << errors();
  const LabelImage labels = read_labels(folder_ / "out" / "labels.vti");
  const Eigen::Vector3d index(2, 7, 5), file_mm = image_.grid.point(index);
  EXPECT_LT((labels.grid.point(index) - Eigen::Vector3d(file_mm.y(), -file_mm.x(), file_mm.z())).norm(), 1e-9);
  EXPECT_EQ(labels.at(2, 7, 5), static_cast<std::uint8_t>(Tissue::muscle));
  write_case("labels.nrrd", "labels", "");
  ASSERT_EQ(run("--force"), 0);
  EXPECT_NE(errors().find("names no patient frame; taken as LPS"), std::string::npos) << errors();
}

TEST_F(SegmentTool, RefusesToOverruleTheFrameOfAFile) {
  write_case("labels.nrrd", "labels\"\nframe = \"ALS", "");
  expect_refused(run(), "the file names its own frame, LPS; take image.frame = \"ALS\" out");
}

TEST_F(SegmentTool, WarnsWhereProneDoesNotFallToTheFront) {
  ASSERT_EQ(run(), 0);
  EXPECT_EQ(errors().find("falls to the front"), std::string::npos) << errors();
  std::string text = text_of(folder_ / "case.toml");
  write_text(folder_ / "case.toml", text.replace(text.find("0.0, -1.0, 0.0"), 14, "1.0, 0.0, 0.00"));
  ASSERT_EQ(run("--force"), 0);
  EXPECT_NE(errors().find("[pose.prone] gravity is LPS (1.00, 0.00, 0.00)"), std::string::npos) << errors();
}

TEST_F(SegmentTool, RefusesUnlistedLabel) {
  image_.at(5, 5, 5) = 9;
  write_nrrd(folder_ / "labels.nrrd", image_);
  expect_refused(run(), "label value 9 is in 1 voxels");
}

TEST_F(SegmentTool, RefusesMissingMuscle) {
  for (float& v : image_.voxels) v = v == 40 ? 7 : v;
  write_nrrd(folder_ / "labels.nrrd", image_);
  expect_refused(run(), "muscle");
}

TEST_F(SegmentTool, RefusesTissueAtTheEdge) {
  image_.at(0, 5, 5) = 7;
  write_nrrd(folder_ / "labels.nrrd", image_);
  expect_refused(run(), "face i = 0");
}

TEST_F(SegmentTool, RefusesTruncatedVolume) {
  fs::resize_file(folder_ / "labels.nrrd", fs::file_size(folder_ / "labels.nrrd") - 1);
  expect_refused(run(), "truncated");
}

TEST_F(SegmentTool, RefusesMriWithoutRecipeAndRecipeWithoutMri) {
  write_text(folder_ / "r.toml", "[[segmentation.step]]\ndo = \"noise_floor\"\nair_below = 60\n");
  expect_refused(run("--recipe " + (folder_ / "r.toml").string()), "a recipe needs \"mri\"");
  write_case("labels.nrrd", "mri", "");
  expect_refused(run(), "[segmentation]");
}

}  // namespace
}  // namespace supine::segmentation
