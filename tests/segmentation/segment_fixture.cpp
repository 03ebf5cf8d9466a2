// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/segmentation/segment_fixture.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace supine::segmentation::testing {
namespace {

namespace fs = std::filesystem;

fs::path tool() { return fs::path(SUPINE_BIN_DIR) / "supine-segment"; }

}  // namespace

void SegmentFixture::SetUp() {
  if (!fs::exists(tool())) GTEST_SKIP() << tool() << " is not built";
}

GreyImage SegmentFixture::block(float air, float fat, float muscle) {
  GreyImage image;
  image.grid.size = {10, 10, 10};
  image.grid.spacing_mm = {2, 2, 2};
  image.voxels.assign(1000, air);
  for (int k = 1; k < 9; ++k)
    for (int j = 1; j < 9; ++j)
      for (int i = 1; i < 9; ++i) image.at(i, j, k) = j > 6 ? muscle : fat;
  return image;
}

int SegmentFixture::run(const std::string& options) const {
  const std::string command = fmt::format("{} {} {} >{} 2>{}", tool().string(), folder_.path().string(), options,
                                          (folder_ / "stdout").string(), (folder_ / "stderr").string());
  return WEXITSTATUS(std::system(command.c_str()));
}

std::string SegmentFixture::errors() const { return text_of(folder_ / "stderr"); }

void SegmentFixture::expect_refused(int code, const std::string& because) const {
  EXPECT_EQ(code, 2);
  EXPECT_NE(errors().find(because), std::string::npos) << errors();
  EXPECT_TRUE(!fs::exists(folder_ / "out") || fs::is_empty(folder_ / "out"));
}

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

}  // namespace supine::segmentation::testing
