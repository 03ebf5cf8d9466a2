// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/labels_io.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "segmentation/tissue.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using namespace testing;

LabelImage some_labels() {
  LabelImage labels{numbered_image(oblique()).grid, std::vector<std::uint8_t>(60)};
  for (std::size_t n = 0; n < 60; ++n) labels.voxels[n] = static_cast<std::uint8_t>(n % tissue_count);
  return labels;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}

TEST(LabelsIo, RoundTripKeepsEverythingExactly) {
  const TemporaryFolder folder;
  const LabelImage labels = some_labels();
  write_labels(labels, folder / "labels.vti");
  const LabelImage read = read_labels(folder / "labels.vti");
  EXPECT_EQ(read.voxels, labels.voxels);
  EXPECT_EQ(read.grid.size, labels.grid.size);
  EXPECT_NEAR((read.grid.origin_mm - labels.grid.origin_mm).norm(), 0, 1e-12);
  EXPECT_NEAR((read.grid.spacing_mm - labels.grid.spacing_mm).norm(), 0, 1e-12);
  EXPECT_NEAR((read.grid.direction - labels.grid.direction).norm(), 0, 1e-12);
}

TEST(LabelsIo, SameLabelsSameBytes) {
  const TemporaryFolder folder;
  write_labels(some_labels(), folder / "a.vti");
  write_labels(some_labels(), folder / "b.vti");
  EXPECT_EQ(bytes_of(folder / "a.vti"), bytes_of(folder / "b.vti"));
  EXPECT_NE(bytes_of(folder / "a.vti").find("tissue_names"), std::string::npos);
}

TEST(LabelsIo, NotesTravelWithTheLabels) {
  const TemporaryFolder folder;
  const LabelNotes notes = {{"cut", "edge,rim"}, {"rim_mm", "12.5"}};
  write_labels(some_labels(), folder / "noted.vti", notes);
  write_labels(some_labels(), folder / "bare.vti");
  EXPECT_EQ(read_label_notes(folder / "noted.vti"), notes);
  EXPECT_TRUE(read_label_notes(folder / "bare.vti").empty());
}

TEST(LabelsIo, NamedSupportsTravelWithTheLabels) {
  const TemporaryFolder folder;
  const LabelImage labels = some_labels();
  SupportVoxels supports{{"clamp", "rest"}, std::vector<std::uint8_t>(60, 0)};
  supports.number[3] = 1;
  supports.number[59] = 2;
  write_labels(labels, folder / "named.vti", {}, {}, supports);
  const SupportVoxels read = read_label_supports(folder / "named.vti");
  EXPECT_EQ(read.names, supports.names);
  EXPECT_EQ(read.number, supports.number);
  EXPECT_EQ(read_labels(folder / "named.vti").voxels, labels.voxels);
  write_labels(labels, folder / "bare.vti");
  EXPECT_TRUE(read_label_supports(folder / "bare.vti").names.empty());
  supports.number.assign(60, 0);
  write_labels(labels, folder / "nowhere.vti", {}, {}, supports);
  EXPECT_NE(message_of([&] { read_label_supports(folder / "nowhere.vti"); }).find("no voxel of array `support`"),
            std::string::npos);
  supports.number[7] = 3;
  write_labels(labels, folder / "wrong.vti", {}, {}, supports);
  EXPECT_NE(message_of([&] { read_label_supports(folder / "wrong.vti"); }).find("value 3 of array `support`"),
            std::string::npos);
}

TEST(LabelsIo, TheShareOfGlandTravelsWithTheLabels) {
  const TemporaryFolder folder;
  const LabelImage labels = some_labels();
  std::vector<float> share(labels.voxels.size());
  for (std::size_t n = 0; n < share.size(); ++n) share[n] = static_cast<float>(n % 5) / 4;
  write_labels(labels, folder / "shared.vti", {}, share);
  EXPECT_EQ(read_gland_share(folder / "shared.vti"), share);
  EXPECT_EQ(read_labels(folder / "shared.vti").voxels, labels.voxels);
  write_labels(labels, folder / "bare.vti");
  EXPECT_TRUE(read_gland_share(folder / "bare.vti").empty());
  share[3] = 1.5f;
  write_labels(labels, folder / "wrong.vti", {}, share);
  EXPECT_NE(message_of([&] { read_gland_share(folder / "wrong.vti"); }).find("1.5"), std::string::npos);
}

TEST(LabelsIo, RefusesValuesThatAreNoTissue) {
  const TemporaryFolder folder;
  write_vti(folder / "grey.vti", numbered_image());
  EXPECT_NE(message_of([&] { read_labels(folder / "grey.vti"); }).find("value 10"), std::string::npos);
}

TEST(LabelsIo, RefusesAFolderThatIsNotThere) {
  EXPECT_NE(message_of([] { write_labels(some_labels(), "/no/such/folder/labels.vti"); }).find("cannot be written"),
            std::string::npos);
}

}  // namespace
}  // namespace supine::segmentation
