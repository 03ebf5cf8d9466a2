// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/segmentation/formats/dicom_files.h"
#include "tests/segmentation/segment_fixture.h"

// What the executable says about a DICOM series that contradicts the case, and about recipes that leave nothing.
namespace supine::segmentation {
namespace {

using namespace testing;
namespace fs = std::filesystem;

const std::string block_recipe = std::string("[segmentation]\n") + fat_step + R"([[segmentation.step]]
do = "threshold"
mask = "muscle"
lower = 10
upper = 59
)" + paint_steps;

class SegmentDicom : public SegmentFixture {
 protected:
  void write_series(const std::string& position, const std::string& laterality) const {
    SeriesHeader header;
    header.position = position;
    header.laterality = laterality;
    fs::create_directory(folder_ / "dicom");
    write_dicom_series(folder_ / "dicom", image_, header);
  }
  /// Exit code of the tool on a case with this side, prone gravity and recipe.
  int run(const std::string& side, double gravity_y, const std::string& recipe = block_recipe) const {
    write_text(
        folder_ / "case.toml",
        fmt::format("[case]\nname = \"t\"\nframe = \"LPS\"\nside = \"{}\"\n[image]\nfile = \"dicom\"\nkind = "
                    "\"mri\"\n[pose.prone]\ngravity = [0.0, {}, 0.0]\n[pose.supine]\ngravity = [0.0, {}, 0.0]\n{}",
                    side, gravity_y, -gravity_y, recipe));
    return SegmentFixture::run("--force");
  }
  const GreyImage image_ = block(3, 50, 20);  // the writer's rescale makes grey = 2 value - 5: air 1, fat 95, muscle 35
};

TEST_F(SegmentDicom, AcceptsAProneSeriesThatFitsTheCase) {
  for (const char* position : {"FFP", "HFP"}) {
    write_series(position, "L");
    EXPECT_EQ(run("left", -1.0), 0) << position << ": " << errors();
  }
}

TEST_F(SegmentDicom, WarnsWhereTheSeriesDoesNotSayHowThePatientLay) {
  write_series("", "");
  EXPECT_EQ(run("left", -1.0), 0) << errors();
  EXPECT_NE(errors().find("does not say how the patient lay"), std::string::npos) << errors();
}

TEST_F(SegmentDicom, RefusesAPositionAgainstGravity) {
  for (const char* position : {"HFS", "FFS"}) {
    write_series(position, "");
    expect_refused(run("left", -1.0), fmt::format("patient supine (patient position {})", position));
    EXPECT_NE(errors().find("points to the patient's front"), std::string::npos) << errors();
  }
  for (const char* position : {"HFP", "FFP"}) {
    write_series(position, "");
    expect_refused(run("left", 1.0), fmt::format("patient prone (patient position {})", position));
    EXPECT_NE(errors().find("points to the patient's back"), std::string::npos) << errors();
  }
}

TEST_F(SegmentDicom, RefusesTheOtherBreast) {
  write_series("FFP", "L");
  expect_refused(run("right", -1.0), "shows the left breast only (laterality L), but case.side is \"right\"");
  expect_refused(run("both", -1.0), "shows the left breast only (laterality L), but case.side is \"both\"");
  write_series("FFP", "R");
  expect_refused(run("left", -1.0), "shows the right breast only (laterality R), but case.side is \"left\"");
}

TEST_F(SegmentDicom, RefusesASeedInAirAndAStepThatLeavesNothing) {
  write_series("FFP", "");
  expect_refused(run("left", -1.0, R"([segmentation]
[[segmentation.step]]
do = "grow"
mask = "muscle"
seeds_mm = [[0, 0, 0]]
lower = 10
)"),
                 "step 1 (grow)");
  EXPECT_NE(errors().find("(0"), std::string::npos) << errors();
  expect_refused(run("left", -1.0, R"([segmentation]
[[segmentation.step]]
do = "threshold"
mask = "fat"
lower = 1000
)"),
                 "step 1 (threshold): the mask \"fat\" comes out empty");
}

}  // namespace
}  // namespace supine::segmentation
