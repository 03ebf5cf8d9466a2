// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/data_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace supine::segmentation {
namespace {

namespace fs = std::filesystem;

class DetachedDataFile : public ::testing::Test {
 protected:
  DetachedDataFile() {
    fs::create_directories(folder);
    write("voxels.raw", "0000");
  }
  ~DetachedDataFile() override { fs::remove_all(folder); }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder / name, std::ios::binary) << text;
    return folder / name;
  }
  const fs::path folder = fs::temp_directory_path() / ("data_file_test_" + std::to_string(getpid()));
};

TEST_F(DetachedDataFile, IsFoundBesideNrrdAndMetaImageHeaders) {
  for (const char* text : {"NRRD0004\ntype: uint8\ndata file: voxels.raw\n", "NRRD0004\ndatafile: voxels.raw\r\n",
                           "NDims = 3\nElementDataFile = voxels.raw\n"})
    EXPECT_EQ(detached_data_file(write("header", text)), folder / "voxels.raw") << text;
}

TEST_F(DetachedDataFile, IsNothingWhereTheVoxelsAreInTheHeaderOrInAList) {
  for (const char* text : {"NRRD0004\ntype: uint8\n\ndata file: voxels.raw", "NDims = 3\nElementDataFile = LOCAL\n",
                           "ElementDataFile = slice%03d.raw 1 10 1\n", "NRRD0004\ndata file: gone.raw\n", ""})
    EXPECT_EQ(detached_data_file(write("header", text)), std::nullopt) << text;
}

}  // namespace
}  // namespace supine::segmentation
