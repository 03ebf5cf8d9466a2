// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/label_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using testing::message_of;

const std::map<int, Tissue> table = {{0, Tissue::air}, {1, Tissue::adipose}, {29, Tissue::gland}, {40, Tissue::muscle}};

/// A cube of size^3 voxels of 1 mm with the corner at the origin, all of one value.
template <class T>
Image<T> cube(int size, T value) {
  Image<T> image;
  image.grid.size.setConstant(size);
  image.voxels.assign(image.grid.count(), value);
  return image;
}

std::uint8_t number(Tissue tissue) { return static_cast<std::uint8_t>(tissue); }

/// Muscle below (k < 2), adipose above, air all around.
LabelImage body() {
  LabelImage labels = cube<std::uint8_t>(8, 0);
  for (int k = 1; k < 7; ++k)
    for (int j = 1; j < 7; ++j)
      for (int i = 1; i < 7; ++i) labels.at(i, j, k) = number(k < 2 ? Tissue::muscle : Tissue::adipose);
  return labels;
}

TEST(LabelMap, MapsEveryValueByTheTable) {
  GreyImage image = cube<float>(3, 0);
  image.at(0, 0, 0) = 1;
  image.at(1, 0, 0) = 29;
  image.at(2, 0, 0) = 40;
  const MappedLabels mapped = map_labels(image, table, "labels.nrrd");
  EXPECT_EQ(mapped.image.at(0, 0, 0), number(Tissue::adipose));
  EXPECT_EQ(mapped.image.at(1, 0, 0), number(Tissue::gland));
  EXPECT_EQ(mapped.image.at(2, 0, 0), number(Tissue::muscle));
  EXPECT_EQ(count_tissues(mapped.image)[0], 24u);
  EXPECT_TRUE(mapped.warnings.empty());
}

TEST(LabelMap, ListedValueThatDoesNotOccurIsAWarning) {
  GreyImage image = cube<float>(3, 1);
  image.at(0, 0, 0) = 29;
  image.at(0, 0, 1) = 40;
  auto more = table;
  more[95] = Tissue::gland;
  const auto warnings = map_labels(image, more, "labels.nrrd").warnings;
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("0 (air)"), std::string::npos);
  EXPECT_NE(warnings[1].find("95 (gland)"), std::string::npos);
}

TEST(LabelMap, RefusesAListedTissueWithoutAnyVoxel) {
  GreyImage image = cube<float>(3, 1);
  image.at(0, 0, 1) = 40;
  const std::string message = message_of([&] { map_labels(image, table, "labels.nrrd"); });
  for (const char* part : {"labels.nrrd", "empty label", "gland", "29"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(LabelMap, RefusesUnlistedValueWithCountAndPlace) {
  GreyImage image = cube<float>(3, 1);
  image.at(1, 2, 0) = image.at(2, 2, 2) = 7;
  const std::string message = message_of([&] { map_labels(image, table, "labels.nrrd"); });
  for (const char* part : {"labels.nrrd", "value 7", "2 voxels", "(1.0, 2.0, 0.0) mm", "[image.labels]"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(LabelMap, RefusesValuesThatAreNotWholeOrBeyondTheTable) {
  for (const float value : {0.5f, -1.0f, 1e6f})
    EXPECT_NE(message_of([&] { map_labels(cube(2, value), table, "x"); }).find("not in [image.labels]"),
              std::string::npos);
}

TEST(LabelMap, RefusesMissingMuscleAndMissingTissue) {
  LabelImage labels = body();
  EXPECT_EQ(message_of([&] { check_tissues(labels, "x"); }), "");
  for (auto& v : labels.voxels)
    if (v == number(Tissue::muscle)) v = 0;
  EXPECT_NE(message_of([&] { check_tissues(labels, "x"); }).find("muscle"), std::string::npos);
  for (auto& v : labels.voxels) v = v ? number(Tissue::muscle) : 0;
  EXPECT_NE(message_of([&] { check_tissues(labels, "x"); }).find("adipose or gland"), std::string::npos);
}

TEST(LabelMap, TissueAtTheEdgeIsRefusedButMuscleAndExcludedAreNot) {
  LabelImage labels = body();
  labels.at(0, 3, 3) = number(Tissue::muscle);
  labels.at(7, 3, 3) = number(Tissue::excluded);
  EXPECT_EQ(message_of([&] { check_edge(labels, "x"); }), "");
  labels.at(3, 7, 3) = labels.at(4, 7, 3) = number(Tissue::gland);
  const std::string message = message_of([&] { check_edge(labels, "x"); });
  for (const char* part : {"2 on face j = 7", "first gland at (3.0, 7.0, 3.0) mm", "image.cut"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_EQ(message.find("face i"), std::string::npos);
}

TEST(LabelMap, TissueNextToExcludedIsRefused) {
  LabelImage labels = body();
  EXPECT_EQ(message_of([&] { check_excluded(labels, "x"); }), "");
  labels.at(7, 3, 3) = number(Tissue::excluded);
  EXPECT_NE(message_of([&] {
              check_excluded(labels, "x");
            }).find("1 tissue voxels border on excluded (first adipose at (6.0, 3.0, 3.0) mm)"),
            std::string::npos);
}

TEST(LabelMap, TwoTouchingLabelsAreTwoTissuesAndOneBody) {
  LabelImage labels = body();
  for (int k = 4; k < 7; ++k) labels.at(3, 3, k) = number(Tissue::gland);
  labels.at(0, 0, 0) = number(Tissue::gland);
  const ComponentCounts counts = count_components(labels);
  EXPECT_EQ(counts.tissue[number(Tissue::gland)], 2u);
  EXPECT_EQ(counts.tissue[number(Tissue::adipose)], 1u);
  EXPECT_EQ(counts.meshed, 2u);
}

TEST(LabelMap, DiceCountsOverlap) {
  const LabelImage truth = body();
  LabelImage labels = truth;
  const Dice same = dice(labels, truth);
  EXPECT_EQ(same.breast, 1);
  EXPECT_EQ(same.tissue[number(Tissue::muscle)], 1);
  EXPECT_TRUE(std::isnan(same.tissue[number(Tissue::tumour)]));
  for (int i = 1; i < 7; ++i)
    for (int j = 1; j < 7; ++j) labels.at(i, j, 6) = 0;  // one of five layers of adipose
  EXPECT_DOUBLE_EQ(dice(labels, truth).breast, 2.0 * 4 / (4 + 5));
}

TEST(LabelMap, DiceRefusesAnotherGrid) {
  LabelImage moved = body();
  moved.grid.origin_mm.x() += 0.1;
  EXPECT_NE(message_of([&] { dice(moved, body()); }).find("0.1 mm apart"), std::string::npos);
}

TEST(Tissue, NamesAndNumbersGoTogether) {
  for (int t = 0; t < tissue_count; ++t) EXPECT_EQ(tissue_from_name(tissue_names[t]), static_cast<Tissue>(t));
  EXPECT_FALSE(tissue_from_name("bone"));
}

}  // namespace
}  // namespace supine::segmentation
