// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/segmentation/formats/dicom_files.h"

#include <fmt/format.h>
#include <gdcmUIDGenerator.h>
#include <gdcmWriter.h>

#include <cstdint>
#include <vector>

namespace supine::segmentation::testing {
namespace {

namespace fs = std::filesystem;

class Elements {
 public:
  explicit Elements(gdcm::DataSet& set) : set_(set) {}
  void text(std::uint16_t group, std::uint16_t element, gdcm::VR::VRType vr, std::string value) {
    if (value.empty()) return;
    if (value.size() % 2 == 1) value += vr == gdcm::VR::UI ? '\0' : ' ';
    bytes(group, element, vr, value.data(), value.size());
  }
  void number(std::uint16_t group, std::uint16_t element, std::uint16_t value) {
    bytes(group, element, gdcm::VR::US, reinterpret_cast<const char*>(&value), sizeof value);
  }
  void bytes(std::uint16_t group, std::uint16_t element, gdcm::VR::VRType vr, const char* from, std::size_t size) {
    gdcm::DataElement data(gdcm::Tag(group, element));
    data.SetVR(vr);
    data.SetByteValue(from, static_cast<std::uint32_t>(size));
    set_.Replace(data);
  }

 private:
  gdcm::DataSet& set_;
};

std::string joined(const Eigen::Vector3d& v) { return fmt::format("{:.6f}\\{:.6f}\\{:.6f}", v.x(), v.y(), v.z()); }

}  // namespace

void write_dicom_slice(const fs::path& file, const GreyImage& image, int k, const SeriesHeader& header,
                       const Eigen::Vector3d& shift_mm) {
  const Grid& grid = image.grid;
  std::vector<std::uint16_t> pixels;
  for (int repeat = 0; repeat < header.samples * header.frames; ++repeat)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) pixels.push_back(static_cast<std::uint16_t>(image.at(i, j, k)));
  gdcm::Writer writer;
  writer.SetFileName(file.c_str());
  Elements e(writer.GetFile().GetDataSet());
  using gdcm::VR;
  e.text(0x0008, 0x0016, VR::UI, "1.2.840.10008.5.1.4.1.1.4");  // MR image storage
  e.text(0x0008, 0x0018, VR::UI, fmt::format("{}.{}", header.uid, k + 1));
  e.text(0x0008, 0x0060, VR::CS, "MR");
  e.text(0x0008, 0x103e, VR::LO, header.description);
  e.text(0x0018, 0x5100, VR::CS, header.position);
  e.text(0x0020, 0x000e, VR::UI, header.uid);
  e.text(0x0020, 0x0011, VR::IS, header.number);
  e.text(0x0020, 0x0013, VR::IS, "1");  // instance numbers do not count
  e.text(0x0020, 0x0032, VR::DS, joined(grid.point(Eigen::Vector3d(0, 0, k)) + shift_mm));
  e.text(0x0020, 0x0037, VR::DS, joined(grid.direction.col(0)) + "\\" + joined(grid.direction.col(1)));
  e.text(0x0020, 0x0052, VR::UI, header.frame_of_reference);
  e.text(0x0020, 0x0060, VR::CS, header.laterality);
  e.number(0x0028, 0x0002, static_cast<std::uint16_t>(header.samples));
  e.text(0x0028, 0x0004, VR::CS, header.samples == 1 ? "MONOCHROME2" : "RGB");
  if (header.samples > 1) e.number(0x0028, 0x0006, 0);
  if (header.frames > 1) e.text(0x0028, 0x0008, VR::IS, fmt::format("{}", header.frames));
  e.number(0x0028, 0x0010, static_cast<std::uint16_t>(grid.size.y()));
  e.number(0x0028, 0x0011, static_cast<std::uint16_t>(grid.size.x()));
  e.text(0x0028, 0x0030, VR::DS, fmt::format("{:.6f}\\{:.6f}", grid.spacing_mm.y(), grid.spacing_mm.x()));
  e.number(0x0028, 0x0100, 16);
  e.number(0x0028, 0x0101, 16);
  e.number(0x0028, 0x0102, 15);
  e.number(0x0028, 0x0103, 0);
  e.text(0x0028, 0x1052, VR::DS, "-5");  // rescale: grey = 2 value - 5
  e.text(0x0028, 0x1053, VR::DS, "2");
  e.bytes(0x7fe0, 0x0010, VR::OW, reinterpret_cast<const char*>(pixels.data()), 2 * pixels.size());
  writer.GetFile().GetHeader().SetDataSetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
  writer.Write();
}

void write_dicom_series(const fs::path& folder, const GreyImage& image, const SeriesHeader& header) {
  for (int k = 0; k < image.grid.size.z(); ++k)
    write_dicom_slice(folder / fmt::format("{}_{:03d}.dcm", header.number, (7 * k) % image.grid.size.z()), image, k,
                      header);
}

}  // namespace supine::segmentation::testing
