// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "segmentation/labels_io.h"
#include "segmentation/tissue.h"
#include "tests/segmentation/image_files.h"

// The executable: exit codes, files, figures.
namespace supine::segmentation {
namespace {

using namespace testing;
namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class SegmentTool : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(tool())) GTEST_SKIP() << tool() << " is not built";
    image_ = GreyImage();
    image_.grid.size = {10, 10, 10};
    image_.grid.spacing_mm = {2, 2, 2};
    image_.voxels.assign(1000, 0);
    for (int k = 1; k < 9; ++k)
      for (int j = 1; j < 9; ++j)
        for (int i = 1; i < 9; ++i) image_.at(i, j, k) = j > 6 ? 40 : 7;
    write_nrrd(folder_ / "labels.nrrd", image_);
    write_case("labels.nrrd", "labels", "");
  }
  static fs::path tool() { return fs::path(SUPINE_BIN_DIR) / "supine-segment"; }
  void write_case(const std::string& file, const std::string& kind, const std::string& more) const {
    write_text(
        folder_ / "case.toml",
        fmt::format(
            "[case]\nname = \"t\"\nside = \"left\"\n[image]\nfile = \"{}\"\nkind = \"{}\"\n[image.labels]\nair = "
            "[0]\nadipose = [7]\n"
            "muscle = [40]\n[pose.prone]\ngravity = [0.0, -1.0, 0.0]\n[pose.supine]\ngravity = [0.0, 1.0, 0.0]\n{}",
            file, kind, more));
  }
  int run(const std::string& options = "") {
    const std::string command = fmt::format("{} {} {} >{} 2>{}", tool().string(), folder_.path().string(), options,
                                            (folder_ / "stdout").string(), (folder_ / "stderr").string());
    return WEXITSTATUS(std::system(command.c_str()));
  }
  bool nothing_written() const { return !fs::exists(folder_ / "out") || fs::is_empty(folder_ / "out"); }
  void expect_refused(const std::string& because, const std::string& options = "") {
    EXPECT_EQ(run(options), 2);
    const std::string message = text_of(folder_ / "stderr");
    EXPECT_NE(message.find(because), std::string::npos) << message;
    EXPECT_TRUE(nothing_written());
  }
  TemporaryFolder folder_;
  GreyImage image_;
};

TEST_F(SegmentTool, MapsLabelsAndTellsVolumes) {
  ASSERT_EQ(run(), 0) << text_of(folder_ / "stderr");
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

TEST_F(SegmentTool, RunsARecipeAndComparesWithTheTruth) {
  GreyImage grey = image_;
  for (float& v : grey.voxels) v = v == 7 ? 100 : v == 40 ? 20 : 0;
  write_nrrd(folder_ / "mri.nrrd", grey);
  write_case("mri.nrrd", "mri", R"(
[[segmentation.step]]
do = "threshold"
mask = "fat"
lower = 60
[[segmentation.step]]
do = "grow"
mask = "muscle"
seeds_mm = [[10, 16, 10]]
lower = 10
upper = 60
[[segmentation.step]]
do = "paint"
mask = "fat"
tissue = "adipose"
[[segmentation.step]]
do = "paint"
mask = "muscle"
tissue = "muscle"
)");
  ASSERT_EQ(run("--truth " + (folder_ / "labels.nrrd").string()), 0) << text_of(folder_ / "stderr");
  const auto figures = nlohmann::json::parse(text_of(folder_ / "out" / "labels.json"));
  EXPECT_EQ(figures["dice_breast"], 1);
  EXPECT_EQ(figures["dice"]["muscle"], 1);
  EXPECT_EQ(figures["recipe"].size(), 4u);
}

TEST_F(SegmentTool, RefusesUnlistedLabel) {
  image_.at(5, 5, 5) = 9;
  write_nrrd(folder_ / "labels.nrrd", image_);
  expect_refused("label value 9 is in 1 voxels");
}

TEST_F(SegmentTool, RefusesMissingMuscle) {
  for (float& v : image_.voxels) v = v == 40 ? 7 : v;
  write_nrrd(folder_ / "labels.nrrd", image_);
  expect_refused("muscle");
}

TEST_F(SegmentTool, RefusesTissueAtTheEdge) {
  image_.at(0, 5, 5) = 7;
  write_nrrd(folder_ / "labels.nrrd", image_);
  expect_refused("face i = 0");
}

TEST_F(SegmentTool, RefusesTruncatedVolume) {
  fs::resize_file(folder_ / "labels.nrrd", fs::file_size(folder_ / "labels.nrrd") - 1);
  expect_refused("truncated");
}

TEST_F(SegmentTool, RefusesMriWithoutRecipeAndRecipeWithoutMri) {
  write_text(folder_ / "r.toml", "[[segmentation.step]]\ndo = \"noise_floor\"\nair_below = 60\n");
  expect_refused("a recipe needs \"mri\"", "--recipe " + (folder_ / "r.toml").string());
  write_case("labels.nrrd", "mri", "");
  expect_refused("[segmentation]");
}

}  // namespace
}  // namespace supine::segmentation
