// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/dicom_segmentation.h"

#include <fmt/format.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "common/error.h"
#include "common/trial_process.h"
#include "segmentation/formats/dicom_file.h"

namespace supine::segmentation::formats {
namespace {

namespace fs = std::filesystem;

constexpr const char* segmentation_class = "1.2.840.10008.5.1.4.1.1.66.4";
constexpr const char* label_map_class = "1.2.840.10008.5.1.4.1.1.66.7";
constexpr double same_direction = 1e-4, same_place_mm = 0.02, even_share = 0.02;
const gdcm::Tag shared_groups(0x5200, 0x9229), frame_groups(0x5200, 0x9230), pixel_measures(0x0028, 0x9110),
    plane_orientation(0x0020, 0x9116), plane_position(0x0020, 0x9113), segment_identification(0x0062, 0x000a);

using Items = gdcm::SmartPointer<gdcm::SequenceOfItems>;

std::string text(const gdcm::DataSet& set, const gdcm::Tag& tag) {
  const gdcm::ByteValue* bytes = set.FindDataElement(tag) ? set.GetDataElement(tag).GetByteValue() : nullptr;
  std::string value = bytes ? std::string(bytes->GetPointer(), bytes->GetLength()) : std::string();
  while (!value.empty() && (value.back() == ' ' || value.back() == '\0')) value.pop_back();
  return value;
}

std::vector<double> numbers(const gdcm::DataSet& set, const gdcm::Tag& tag) {
  std::vector<double> values;
  const std::string all = text(set, tag);
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t end = std::min(all.find('\\', at), all.size());
    values.push_back(std::strtod(all.substr(at, end - at).c_str(), nullptr));
    at = end + 1;
  }
  return values;
}

/// A whole number of two bytes, little endian.
std::optional<int> whole(const gdcm::DataSet& set, const gdcm::Tag& tag) {
  const gdcm::ByteValue* bytes = set.FindDataElement(tag) ? set.GetDataElement(tag).GetByteValue() : nullptr;
  if (!bytes || bytes->GetLength() < 2) return std::nullopt;
  const auto* b = reinterpret_cast<const unsigned char*>(bytes->GetPointer());
  return b[0] | b[1] << 8;
}

Items items(const gdcm::DataSet& set, const gdcm::Tag& tag) {
  return set.FindDataElement(tag) ? set.GetDataElement(tag).GetValueAsSQ() : Items();
}

/// The first item of a sequence inside the groups of a frame, or else of those that all frames share.
std::optional<gdcm::DataSet> functional_group(const gdcm::DataSet& frame, const gdcm::DataSet& shared,
                                              const gdcm::Tag& tag) {
  for (const gdcm::DataSet* set : {&frame, &shared})
    if (const Items found = items(*set, tag); found && found->GetNumberOfItems() > 0)
      return found->GetItem(1).GetNestedDataSet();
  return std::nullopt;
}

struct Frame {
  int segment = 0;
  Eigen::Vector3d corner_mm;
};

/// What the header says.
struct Header {
  enum class Coding { binary, fractional, label_map } coding = Coding::binary;
  int rows = 0, columns = 0, bits = 1;
  double most = 255;  ///< of a fractional value
  Eigen::Vector3d row, column;
  Eigen::Vector2d spacing_mm;  ///< from row to row, from column to column
  double slice_mm = 0;         ///< as said; 0 = not
  std::vector<Frame> frames;
};

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw InputError(fmt::format("{}: {}", file.string(), why));
}

void read_plane(const fs::path& file, const gdcm::DataSet& frame, const gdcm::DataSet& shared, Header& header) {
  const auto measures = functional_group(frame, shared, pixel_measures);
  const auto orientation = functional_group(frame, shared, plane_orientation);
  const auto spacing = measures ? numbers(*measures, {0x0028, 0x0030}) : std::vector<double>();
  const auto cosines = orientation ? numbers(*orientation, {0x0020, 0x0037}) : std::vector<double>();
  if (spacing.size() != 2 || cosines.size() != 6)
    refuse(file, "pixel spacing (0028,0030) or orientation (0020,0037) is missing; export the segmentation again");
  const Eigen::Vector3d row(cosines[0], cosines[1], cosines[2]), column(cosines[3], cosines[4], cosines[5]);
  if (!header.frames.empty() &&
      ((row - header.row).norm() > same_direction || (column - header.column).norm() > same_direction))
    refuse(file, "its frames have more than one orientation (0020,0037); resample it onto one grid");
  header.row = row;
  header.column = column;
  header.spacing_mm = {spacing[0], spacing[1]};
  const auto slice = numbers(*measures, {0x0018, 0x0088});
  if (!slice.empty()) header.slice_mm = slice.front();
}

Header read_header(const fs::path& file, const gdcm::DataSet& set) {
  Header header;
  const std::string type = text(set, {0x0062, 0x0001});
  header.coding = type == "FRACTIONAL"                                                   ? Header::Coding::fractional
                  : type == "LABELMAP" || text(set, {0x0008, 0x0016}) == label_map_class ? Header::Coding::label_map
                                                                                         : Header::Coding::binary;
  header.rows = whole(set, {0x0028, 0x0010}).value_or(0);
  header.columns = whole(set, {0x0028, 0x0011}).value_or(0);
  header.bits = whole(set, {0x0028, 0x0100}).value_or(1);
  header.most = whole(set, {0x0062, 0x000e}).value_or(255);
  const int wanted_bits = header.coding == Header::Coding::binary ? 1 : header.bits == 16 ? 16 : 8;
  if (header.rows == 0 || header.columns == 0 || header.bits != wanted_bits ||
      (header.bits == 16 && header.coding != Header::Coding::label_map))
    refuse(file, fmt::format("{} x {} pixels of {} bits: no segmentation that is read (binary 1, fractional 8, label "
                             "map 8 or 16 bits)",
                             header.columns, header.rows, header.bits));
  const Items shared_items = items(set, shared_groups), frames = items(set, frame_groups);
  if (!frames || frames->GetNumberOfItems() == 0)
    refuse(file, "no frame says where it lies (5200,9230); export the segmentation again");
  const gdcm::DataSet shared = shared_items && shared_items->GetNumberOfItems() > 0
                                   ? shared_items->GetItem(1).GetNestedDataSet()
                                   : gdcm::DataSet();
  for (std::size_t n = 1; n <= frames->GetNumberOfItems(); ++n) {
    const gdcm::DataSet& frame = frames->GetItem(n).GetNestedDataSet();
    read_plane(file, frame, shared, header);
    const auto position = functional_group(frame, shared, plane_position);
    const auto segment = functional_group(frame, shared, segment_identification);
    const auto corner = position ? numbers(*position, {0x0020, 0x0032}) : std::vector<double>();
    const auto number = segment ? whole(*segment, {0x0062, 0x000b}) : std::nullopt;
    if (corner.size() != 3 || (!number && header.coding != Header::Coding::label_map))
      refuse(file, fmt::format("frame {} does not say where it lies or which segment it shows; export the segmentation "
                               "again",
                               n));
    header.frames.push_back({number.value_or(0), {corner[0], corner[1], corner[2]}});
  }
  return header;
}

/// The grid that holds all frames, and the slice of each.
struct Layout {
  RawImage image;
  std::vector<int> slice;
};

Layout lay_out(const fs::path& file, const Header& header) {
  const Eigen::Vector3d normal = header.row.cross(header.column).normalized();
  std::vector<double> places;
  for (const Frame& frame : header.frames) places.push_back(normal.dot(frame.corner_mm));
  std::vector<double> sorted = places;
  std::sort(sorted.begin(), sorted.end());
  double step = header.slice_mm > 0 ? header.slice_mm : INFINITY;
  for (std::size_t n = 1; n < sorted.size(); ++n)
    if (const double gap = sorted[n] - sorted[n - 1]; gap > same_place_mm) step = std::min(step, gap);
  if (!std::isfinite(step))
    refuse(file, "all frames lie in one plane and the spacing of slices (0018,0088) is not said; a volume is needed");
  Layout layout;
  const std::size_t lowest = static_cast<std::size_t>(std::min_element(places.begin(), places.end()) - places.begin());
  const Eigen::Vector3d origin = header.frames[lowest].corner_mm;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const double at = (places[n] - places[lowest]) / step;
    const Eigen::Vector3d aside = header.frames[n].corner_mm - origin - (places[n] - places[lowest]) * normal;
    if (std::abs(at - std::round(at)) > even_share * std::max(1.0, at) || aside.norm() > 10 * same_place_mm)
      refuse(file, fmt::format("frame {} does not lie on the grid of the others ({:.3f} slices of {:.3f} mm from the "
                               "first, {:.2f} mm aside); resample the segmentation",
                               n + 1, at, step, aside.norm()));
    layout.slice.push_back(static_cast<int>(std::lround(at)));
  }
  RawImage& image = layout.image;
  image.grid.size = {header.columns, header.rows, *std::max_element(layout.slice.begin(), layout.slice.end()) + 1};
  check_size(file, image.grid.size);
  image.grid.origin_mm = origin;
  image.axes.col(0) = header.row * header.spacing_mm[1];
  image.axes.col(1) = header.column * header.spacing_mm[0];
  image.axes.col(2) = normal * step;
  image.frame = "LPS";
  image.voxels.assign(image.grid.count(), 0);
  return layout;
}

/// The label that pixel n of all frames (in the order of the file) gives; 0 for none.
int label_at(const Header& header, const unsigned char* bytes, std::size_t n, int segment) {
  switch (header.coding) {
    case Header::Coding::binary:
      return bytes[n / 8] >> (n % 8) & 1 ? segment : 0;
    case Header::Coding::fractional:
      return 2 * bytes[n] >= header.most ? segment : 0;
    default:
      return header.bits == 16 ? bytes[2 * n] | bytes[2 * n + 1] << 8 : bytes[n];
  }
}

RawImage read(const fs::path& file) {
  gdcm::Trace::WarningOff();  // a library does not print
  gdcm::Trace::ErrorOff();
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.Read()) refuse(file, "cannot be read as DICOM: cut short or damaged; copy it again");
  const gdcm::DataSet& set = reader.GetFile().GetDataSet();
  const std::string kind = text(set, {0x0008, 0x0016});
  if (kind != segmentation_class && kind != label_map_class)
    refuse(file, fmt::format("a DICOM file that is no segmentation ({}, class {}); of a series name the folder",
                             text(set, {0x0008, 0x0060}), kind));
  const Header header = read_header(file, set);
  Layout layout = lay_out(file, header);
  const gdcm::Tag pixel_data(0x7fe0, 0x0010);
  const gdcm::ByteValue* pixels =
      set.FindDataElement(pixel_data) ? set.GetDataElement(pixel_data).GetByteValue() : nullptr;
  if (!pixels) refuse(file, "its pixels are compressed or missing; export the segmentation uncompressed");
  const std::size_t plane = static_cast<std::size_t>(header.rows) * header.columns,
                    needed = (plane * header.frames.size() * static_cast<std::size_t>(header.bits) + 7) / 8;
  if (is_cut_short(file)) refuse(file, "the file ends before its pixels do: cut short; copy it again");
  if (pixels->GetLength() < needed)
    refuse(file, fmt::format("holds {} bytes of pixels, {} are expected: damaged; export it again",
                             static_cast<std::size_t>(pixels->GetLength()), needed));
  const auto* bytes = reinterpret_cast<const unsigned char*>(pixels->GetPointer());
  std::size_t twice = 0;
  for (std::size_t f = 0; f < header.frames.size(); ++f) {
    float* slice = layout.image.voxels.data() + plane * static_cast<std::size_t>(layout.slice[f]);
    for (std::size_t n = 0; n < plane; ++n) {
      const auto label = static_cast<float>(label_at(header, bytes, f * plane + n, header.frames[f].segment));
      if (label == 0) continue;
      twice += slice[n] != 0;
      slice[n] = std::max(slice[n], label);
    }
  }
  if (twice > 0)
    layout.image.warnings.push_back(
        fmt::format("{} voxels lie in more than one segment; the segment of the higher number holds there", twice));
  return std::move(layout.image);
}

}  // namespace

RawImage read_dicom_segmentation(const fs::path& file) {
  // GDCM's assertions end the process on damaged files.
  check_survivable(file, [&] { read(file); });
  return read(file);
}

}  // namespace supine::segmentation::formats
