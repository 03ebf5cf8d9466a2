// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation::testing {

/// Runs supine-segment on a case in a folder of its own; skipped where the tool is not built.
class SegmentFixture : public ::testing::Test {
 protected:
  void SetUp() override;

  /// 8 x 8 x 8 voxels of 2 mm in air, one of air around: fat, and muscle in the two layers at the patient's back.
  static GreyImage block(float air, float fat, float muscle);

  /// Exit code of the tool on folder_/case.toml.
  int run(const std::string& options = "") const;
  /// What the last run wrote to its standard error.
  std::string errors() const;
  /// That the last run ended with @p code, which says bad input, gave the reason and left nothing.
  void expect_refused(int code, const std::string& because) const;

  TemporaryFolder folder_;
};

/// Recipe steps: the mask "fat" of what is at least 60, and both masks painted.
inline constexpr const char* fat_step = R"([[segmentation.step]]
do = "threshold"
mask = "fat"
lower = 60
)";
inline constexpr const char* paint_steps = R"([[segmentation.step]]
do = "paint"
mask = "fat"
tissue = "adipose"
[[segmentation.step]]
do = "paint"
mask = "muscle"
tissue = "muscle"
)";

std::string text_of(const std::filesystem::path& file);

}  // namespace supine::segmentation::testing
