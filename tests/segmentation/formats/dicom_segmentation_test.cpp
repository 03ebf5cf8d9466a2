// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/dicom_segmentation.h"

#include <fmt/format.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmWriter.h>
#include <gtest/gtest.h>

#include "tests/segmentation/formats/dicom_files.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using namespace testing;
using gdcm::DataSet;
using gdcm::Tag;
using gdcm::VR;

void put(DataSet& set, const Tag& tag, VR::VRType vr, std::string value) {
  if (value.size() % 2 == 1) value += vr == VR::UI ? '\0' : ' ';
  gdcm::DataElement element(tag);
  element.SetVR(vr);
  element.SetByteValue(value.data(), static_cast<std::uint32_t>(value.size()));
  set.Replace(element);
}

void put(DataSet& set, const Tag& tag, std::uint16_t number) {
  put(set, tag, VR::US, {static_cast<char>(number & 255), static_cast<char>(number >> 8)});
}

void put(DataSet& set, const Tag& tag, const std::vector<DataSet>& items) {
  gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
  sequence->SetLengthToUndefined();
  for (const DataSet& inside : items) {
    gdcm::Item item;
    item.SetVLToUndefined();
    item.SetNestedDataSet(inside);
    sequence->AddItem(item);
  }
  gdcm::DataElement element(tag);
  element.SetVR(VR::SQ);
  element.SetValue(*sequence);
  element.SetVLToUndefined();
  set.Replace(element);
}

std::string joined(const Eigen::Vector3d& v) { return fmt::format("{:.6f}\\{:.6f}\\{:.6f}", v.x(), v.y(), v.z()); }

/// One stored frame: slice, segment, and which of the 6 x 5 pixels it covers.
struct StoredFrame {
  int slice, segment;
  std::vector<int> pixels;
};

Grid seg_grid() {
  Grid grid;
  grid.size = {6, 5, 8};
  grid.spacing_mm = {0.7, 0.8, 3};
  grid.origin_mm = {-10, 20, 30};
  grid.direction = oblique();
  return grid;
}

struct SegFile {
  std::string type = "BINARY", storage = "1.2.840.10008.5.1.4.1.1.66.4";
  std::vector<StoredFrame> frames{{2, 1, {0, 7, 29}}, {5, 1, {3}}, {2, 4, {8}}};
  double aside_mm = 0;  ///< of the last frame, along the rows
  bool says_segment = true;

  std::string pixels() const {
    const bool binary = type == "BINARY";
    std::string bytes((frames.size() * 30 + (binary ? 7 : 0)) / (binary ? 8 : 1), '\0');
    for (std::size_t f = 0; f < frames.size(); ++f)
      for (const int p : frames[f].pixels) {
        const std::size_t n = f * 30 + static_cast<std::size_t>(p);
        if (binary)
          bytes[n / 8] = static_cast<char>(bytes[n / 8] | 1 << (n % 8));
        else
          bytes[n] = static_cast<char>(p == 3 ? 99 : 100);  // of 200: just under and just a half
      }
    return bytes;
  }

  void write(const std::filesystem::path& file) const {
    const Grid grid = seg_grid();
    gdcm::Writer writer;
    writer.SetFileName(file.c_str());
    DataSet& set = writer.GetFile().GetDataSet();
    put(set, {0x0008, 0x0016}, VR::UI, storage);
    put(set, {0x0008, 0x0018}, VR::UI, "1.2.3.4.5");
    put(set, {0x0008, 0x0060}, VR::CS, "SEG");
    put(set, {0x0028, 0x0008}, VR::IS, fmt::format("{}", frames.size()));
    put(set, {0x0028, 0x0010}, 5);
    put(set, {0x0028, 0x0011}, 6);
    put(set, {0x0028, 0x0100}, type == "BINARY" ? 1 : 8);
    put(set, {0x0062, 0x0001}, VR::CS, type);
    put(set, {0x0062, 0x000e}, 200);
    DataSet measures, orientation, shared;
    put(measures, {0x0028, 0x0030}, VR::DS, fmt::format("{}\\{}", grid.spacing_mm.y(), grid.spacing_mm.x()));
    put(measures, {0x0018, 0x0088}, VR::DS, fmt::format("{}", grid.spacing_mm.z()));
    put(orientation, {0x0020, 0x0037}, VR::DS, joined(grid.direction.col(0)) + "\\" + joined(grid.direction.col(1)));
    put(shared, {0x0028, 0x9110}, std::vector<DataSet>{measures});
    put(shared, {0x0020, 0x9116}, std::vector<DataSet>{orientation});
    put(set, {0x5200, 0x9229}, std::vector<DataSet>{shared});
    std::vector<DataSet> groups;
    for (const StoredFrame& frame : frames) {
      DataSet position, segment, group;
      const Eigen::Vector3d aside = (&frame == &frames.back() ? aside_mm : 0) * grid.direction.col(0);
      put(position, {0x0020, 0x0032}, VR::DS, joined(grid.point(Eigen::Vector3d(0, 0, frame.slice)) + aside));
      put(segment, {0x0062, 0x000b}, static_cast<std::uint16_t>(frame.segment));
      put(group, {0x0020, 0x9113}, std::vector<DataSet>{position});
      if (says_segment) put(group, {0x0062, 0x000a}, std::vector<DataSet>{segment});
      groups.push_back(group);
    }
    put(set, {0x5200, 0x9230}, groups);
    put(set, {0x7fe0, 0x0010}, VR::OB, pixels());
    writer.GetFile().GetHeader().SetDataSetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
    ASSERT_TRUE(writer.Write());
  }
};

class DicomSegmentation : public ::testing::Test {
 protected:
  ImageFile read(const SegFile& seg) {
    seg.write(file_);
    return read_image(file_, "");
  }
  void expect_refused(const SegFile& seg, const std::string& because) {
    seg.write(file_);
    const std::string message = message_of([&] { read_image(file_, ""); });
    EXPECT_NE(message.find(because), std::string::npos) << message;
  }
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "labels.dcm";
};

TEST_F(DicomSegmentation, SegmentsBecomeLabelsInTheirPlaces) {
  const ImageFile read_back = read({});
  EXPECT_EQ(read_back.frame, "LPS");
  EXPECT_TRUE(read_back.warnings.empty());
  const Grid& grid = read_back.image.grid;
  ASSERT_EQ(grid.size, Eigen::Vector3i(6, 5, 4));  // slices 2 to 5; 3 and 4 are not stored
  EXPECT_LT((grid.spacing_mm - seg_grid().spacing_mm).norm(), 1e-5);
  EXPECT_LT((grid.direction - seg_grid().direction).norm(), 1e-5);
  EXPECT_LT((grid.origin_mm - seg_grid().point({0, 0, 2})).norm(), 1e-5);
  std::vector<float> wanted(120, 0);
  wanted[0] = wanted[7] = wanted[29] = wanted[90 + 3] = 1;
  wanted[8] = 4;
  EXPECT_EQ(read_back.image.voxels, wanted);
}

TEST_F(DicomSegmentation, FractionsCountFromAHalf) {
  SegFile seg;
  seg.type = "FRACTIONAL";
  const auto voxels = read(seg).image.voxels;
  EXPECT_EQ(voxels[7], 1);
  EXPECT_EQ(voxels[90 + 3], 0);
}

TEST_F(DicomSegmentation, WhereSegmentsOverlapTheHigherNumberHoldsAndItIsSaid) {
  SegFile seg;
  seg.frames.push_back({2, 2, {7, 8}});
  const ImageFile read_back = read(seg);
  EXPECT_EQ(read_back.image.voxels[7], 2);
  EXPECT_EQ(read_back.image.voxels[8], 4);
  ASSERT_EQ(read_back.warnings.size(), 1u);
  EXPECT_NE(read_back.warnings[0].find("2 voxels lie in more than one segment"), std::string::npos);
}

TEST_F(DicomSegmentation, RefusesWhatIsNone) {
  expect_refused({.storage = "1.2.840.10008.5.1.4.1.1.4"}, "a DICOM file that is no segmentation");
  expect_refused({.says_segment = false}, "does not say where it lies or which segment it shows");
  expect_refused({.aside_mm = 2}, "does not lie on the grid of the others");
  write_dicom_slice(file_, {seg_grid(), std::vector<float>(240, 1)}, 0);
  EXPECT_NE(message_of([&] { read_image(file_, ""); }).find("of a series name the folder"), std::string::npos);
}

TEST_F(DicomSegmentation, RefusesAFileThatIsCutShort) {
  SegFile{}.write(file_);
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) - 6);
  const std::string message = message_of([&] { read_image(file_, ""); });
  EXPECT_NE(message.find("cut short"), std::string::npos) << message;
}

}  // namespace
}  // namespace supine::segmentation
