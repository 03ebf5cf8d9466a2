// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/dicom_io.h"

#include <fmt/format.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmStringFilter.h>
#include <gdcmTrace.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

#include "common/error.h"
#include "common/trial_process.h"
#include "segmentation/formats/dicom_file.h"
#include "segmentation/formats/image_formats.h"
#include "segmentation/formats/samples.h"

namespace supine::segmentation {
namespace {

namespace fs = std::filesystem;

constexpr double same_direction = 1e-4;              // of direction cosines, written with about six digits
constexpr double even_share = 0.01, even_mm = 0.02;  // of the slice spacing: rounding of positions in headers
constexpr double gap_share = 1.5;                    // a step this much longer than the others is a missing slice

/// The header of one file.
struct Slice {
  fs::path file;
  DicomSeries series;  ///< without files
  std::string frame_of_reference;
  int rows = 0, columns = 0, samples = 1, frames = 1;
  std::vector<double> position, orientation, spacing;
};

std::string trimmed(std::string text) {
  const auto blank = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && blank(text.back())) text.pop_back();
  while (!text.empty() && blank(text.front())) text.erase(text.begin());
  return text;
}

/// Numbers of a decimal string, parted by backslashes.
std::vector<double> numbers(const std::string& text) {
  std::vector<double> values;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\\', at), text.size());
    values.push_back(std::strtod(trimmed(text.substr(at, end - at)).c_str(), nullptr));
    at = end + 1;
  }
  return values;
}

/// The header, or nothing for a file that is not a DICOM image.
std::optional<Slice> read_header(const fs::path& file) {
  if (!formats::is_dicom(file)) return std::nullopt;  // others would make the library guess
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0000))) return std::nullopt;
  gdcm::StringFilter strings;
  strings.SetFile(reader.GetFile());
  const auto text = [&](std::uint16_t group, std::uint16_t element) {
    const gdcm::Tag tag(group, element);
    return reader.GetFile().GetDataSet().FindDataElement(tag) ? trimmed(strings.ToString(tag)) : std::string();
  };
  const auto whole = [&](std::uint16_t group, std::uint16_t element, int absent) {
    const auto values = numbers(text(group, element));
    constexpr double most = 1e9;  // no count of rows or frames
    return values.empty() || !std::isfinite(values.front()) ? absent
                                                            : static_cast<int>(std::clamp(values.front(), -most, most));
  };
  Slice slice;
  slice.file = file;
  slice.rows = whole(0x0028, 0x0010, 0);
  slice.columns = whole(0x0028, 0x0011, 0);
  if (slice.rows == 0 || slice.columns == 0) return std::nullopt;
  slice.samples = whole(0x0028, 0x0002, 1);
  slice.frames = whole(0x0028, 0x0008, 1);
  slice.position = numbers(text(0x0020, 0x0032));
  slice.orientation = numbers(text(0x0020, 0x0037));
  slice.spacing = numbers(text(0x0028, 0x0030));
  slice.frame_of_reference = text(0x0020, 0x0052);
  slice.series = {text(0x0020, 0x000e),
                  text(0x0020, 0x0011),
                  text(0x0008, 0x103e),
                  text(0x0008, 0x0060),
                  text(0x0018, 0x5100),
                  text(0x0020, 0x0062),
                  {}};
  if (slice.series.laterality.empty()) slice.series.laterality = text(0x0020, 0x0060);
  return slice;
}

std::vector<Slice> read_headers(const fs::path& folder) {
  gdcm::Trace::WarningOff();  // a library does not print
  gdcm::Trace::ErrorOff();
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->is_regular_file(error)) files.push_back(entry->path());
  if (error) throw InputError(fmt::format("{}: cannot be read: {}", folder.string(), error.message()));
  std::sort(files.begin(), files.end());
  std::vector<Slice> slices;
  for (const fs::path& file : files)
    if (auto slice = read_header(file)) slices.push_back(std::move(*slice));
  if (slices.empty())
    throw InputError(fmt::format("{}: no DICOM image among its {} files; name the folder of the study or of the series",
                                 folder.string(), files.size()));
  return slices;
}

std::vector<DicomSeries> group(const std::vector<Slice>& slices) {
  std::map<std::string, DicomSeries> by_uid;
  for (const Slice& slice : slices) {
    DicomSeries& series = by_uid.try_emplace(slice.series.uid, slice.series).first->second;
    series.files.push_back(slice.file);
  }
  std::vector<DicomSeries> all;
  for (auto& [uid, series] : by_uid) all.push_back(std::move(series));
  std::stable_sort(all.begin(), all.end(), [](const DicomSeries& a, const DicomSeries& b) {
    return std::atoi(a.number.c_str()) < std::atoi(b.number.c_str());
  });
  return all;
}

DicomSeries choose(const fs::path& folder, const std::vector<DicomSeries>& all, const std::string& wanted) {
  std::vector<DicomSeries> fitting;
  for (const DicomSeries& s : all)
    if (wanted.empty() || s.uid == wanted || s.number == wanted || s.description == wanted) fitting.push_back(s);
  if (fitting.size() == 1) return fitting.front();
  const std::string what = wanted.empty()    ? fmt::format("holds {} series", all.size())
                           : fitting.empty() ? fmt::format("holds no series \"{}\"", wanted)
                                             : fmt::format("holds {} series \"{}\"", fitting.size(), wanted);
  throw InputError(
      fmt::format("{} {}; choose one by its number, description or uid: [image] series = \"...\" in case.toml\n{}",
                  folder.string(), what, describe_series(all)));
}

[[noreturn]] void refuse(const Slice& slice, const std::string& why) {
  throw InputError(fmt::format("{}: {}", slice.file.string(), why));
}

void check_slice(const Slice& s) {
  if (s.samples != 1)
    refuse(s, fmt::format("colour ({} samples per pixel); a grey volume is needed: choose another series", s.samples));
  if (s.frames != 1)
    refuse(s, fmt::format("{} frames in one file; convert the series to one slice per file, or to NRRD or NIfTI (a "
                          "DICOM segmentation is named as a file, not by its folder)",
                          s.frames));
  if (s.position.size() != 3 || s.orientation.size() != 6 || s.spacing.size() != 2)
    refuse(s,
           "the slice does not say where it lies: image position (0020,0032), orientation (0020,0037) or pixel "
           "spacing (0028,0030) is missing (a scout or a derived picture?); choose another series");
  for (const auto* numbers : {&s.position, &s.orientation, &s.spacing})
    for (const double number : *numbers)
      if (!std::isfinite(number))
        refuse(s,
               "image position (0020,0032), orientation (0020,0037) or pixel spacing (0028,0030) is not a finite "
               "number: damaged; copy it again");
}

/// All of one size, orientation, spacing and frame of reference.
void check_alike(const std::vector<Slice>& slices) {
  const Slice& first = slices.front();
  const auto differ = [](const std::vector<double>& a, const std::vector<double>& b) {
    for (std::size_t n = 0; n < a.size(); ++n)
      if (std::abs(a[n] - b[n]) > same_direction) return true;
    return false;
  };
  for (const Slice& s : slices) {
    std::string what;
    if (s.rows != first.rows || s.columns != first.columns)
      what = fmt::format("size {} x {} against {} x {}", s.columns, s.rows, first.columns, first.rows);
    else if (differ(s.orientation, first.orientation))
      what = "another orientation (0020,0037)";
    else if (differ(s.spacing, first.spacing))
      what = "another pixel spacing (0028,0030)";
    else if (s.frame_of_reference != first.frame_of_reference)
      what = "another frame of reference (0020,0052)";
    if (!what.empty())
      refuse(s, fmt::format("the slices do not belong together: {} in {} (mixed series?); keep one stack in the folder",
                            what, first.file.filename().string()));
  }
}

struct Stack {
  Eigen::Vector3d row, column, normal;
  double step_mm = 0;
};

Eigen::Vector3d position(const Slice& s) { return {s.position[0], s.position[1], s.position[2]}; }

/// Orders the slices along their normal and checks that they are evenly spaced and not sheared.
Stack order(std::vector<Slice>& slices) {
  const auto& o = slices.front().orientation;
  Stack stack{{o[0], o[1], o[2]}, {o[3], o[4], o[5]}, {}, 0};
  stack.normal = stack.row.cross(stack.column).normalized();
  std::stable_sort(slices.begin(), slices.end(), [&stack](const Slice& a, const Slice& b) {
    return stack.normal.dot(position(a)) < stack.normal.dot(position(b));
  });
  std::vector<double> steps;
  for (std::size_t n = 1; n < slices.size(); ++n)
    steps.push_back(stack.normal.dot(position(slices[n]) - position(slices[n - 1])));
  const auto same =
      static_cast<std::size_t>(std::count_if(steps.begin(), steps.end(), [](double s) { return s < 1e-3; }));
  if (same > 0) {
    const auto at = static_cast<std::size_t>(
        std::find_if(steps.begin(), steps.end(), [](double s) { return s < 1e-3; }) - steps.begin());
    refuse(
        slices[at + 1],
        fmt::format("{} of {} slices lie where another one lies (first at {:.2f} mm along the normal, with {}): a "
                    "series over time, echoes or diffusion (4-D); keep one volume in the folder",
                    same, slices.size(), stack.normal.dot(position(slices[at])), slices[at].file.filename().string()));
  }
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  stack.step_mm = sorted[sorted.size() / 2];
  for (std::size_t n = 0; n < steps.size(); ++n) {
    const double at = stack.normal.dot(position(slices[n]));
    if (steps[n] > gap_share * stack.step_mm)
      refuse(slices[n + 1],
             fmt::format("a slice is missing: from {:.2f} to {:.2f} mm along the normal it is {:.2f} mm, "
                         "elsewhere {:.2f}; copy the whole series",
                         at, at + steps[n], steps[n], stack.step_mm));
    if (std::abs(steps[n] - stack.step_mm) > std::max(even_mm, even_share * stack.step_mm))
      refuse(slices[n + 1],
             fmt::format("uneven slice spacing: {:.3f} mm at {:.2f} mm along the normal, elsewhere {:.3f} "
                         "(bound {:.0f} %); resample the series",
                         steps[n], at, stack.step_mm, 100 * even_share));
  }
  const Eigen::Vector3d way = position(slices.back()) - position(slices.front());
  const double tilt = std::atan2((way - stack.normal * stack.normal.dot(way)).norm(), stack.normal.dot(way));
  if (tilt > 0.005)
    refuse(slices.back(), fmt::format("gantry tilt: the stack leans {:.2f} degrees against the slices' normal (bound "
                                      "0.29); resample it onto a rectangular grid",
                                      tilt * 180 / EIGEN_PI));
  return stack;
}

std::optional<formats::SampleType> sample_type(gdcm::PixelFormat::ScalarType type) {
  using formats::SampleType;
  switch (type) {
    case gdcm::PixelFormat::UINT8:
      return SampleType::u8;
    case gdcm::PixelFormat::INT8:
      return SampleType::i8;
    case gdcm::PixelFormat::UINT16:
      return SampleType::u16;
    case gdcm::PixelFormat::INT16:
      return SampleType::i16;
    case gdcm::PixelFormat::UINT32:
      return SampleType::u32;
    case gdcm::PixelFormat::INT32:
      return SampleType::i32;
    case gdcm::PixelFormat::FLOAT32:
      return SampleType::f32;
    case gdcm::PixelFormat::FLOAT64:
      return SampleType::f64;
    default:
      return std::nullopt;
  }
}

/// Appends the rescaled greys of one slice.
void append_pixels(const Slice& slice, std::vector<float>& voxels) {
  if (formats::is_cut_short(slice.file)) refuse(slice, "the file ends before its pixels do: cut short; copy it again");
  gdcm::ImageReader reader;
  reader.SetFileName(slice.file.c_str());
  if (!reader.Read())
    refuse(slice, "the pixels cannot be read: cut short, damaged or of an unknown compression; copy it again");
  const gdcm::Image& image = reader.GetImage();
  const auto type = sample_type(image.GetPixelFormat().GetScalarType());
  if (!type) refuse(slice, fmt::format("pixel type {} is not read", image.GetPixelFormat().GetScalarTypeAsString()));
  const std::size_t count = static_cast<std::size_t>(slice.rows) * slice.columns;
  std::vector<std::byte> bytes(image.GetBufferLength());
  if (bytes.size() != count * formats::size_of(*type) || !image.GetBuffer(reinterpret_cast<char*>(bytes.data())))
    refuse(slice, fmt::format("holds {} bytes of pixels, {} are expected: cut short or damaged; copy it again",
                              bytes.size(), count * formats::size_of(*type)));
  const std::vector<float> greys = formats::to_floats(bytes, *type, false);
  const auto slope = static_cast<float>(image.GetSlope()), intercept = static_cast<float>(image.GetIntercept());
  for (const float grey : greys) voxels.push_back(slope * grey + intercept);
}

}  // namespace

std::vector<DicomSeries> list_dicom_series(const fs::path& folder) {
  check_survivable(folder, [&] { read_headers(folder); });
  return group(read_headers(folder));
}

std::string describe_series(const std::vector<DicomSeries>& series) {
  std::string text;
  for (const DicomSeries& s : series)
    text += fmt::format("{}  number {}, \"{}\", {}, {} files, {}", text.empty() ? "" : "\n",
                        s.number.empty() ? "?" : s.number, s.description, s.modality.empty() ? "?" : s.modality,
                        s.files.size(), s.uid);
  return text;
}

namespace {

DicomVolume read_volume(const fs::path& folder, const std::string& wanted) {
  std::vector<Slice> slices = read_headers(folder);
  DicomVolume volume;
  volume.series = choose(folder, group(slices), wanted);
  std::erase_if(slices, [&volume](const Slice& s) { return s.series.uid != volume.series.uid; });
  for (const Slice& slice : slices) check_slice(slice);
  check_alike(slices);
  if (slices.size() < 2) refuse(slices.front(), "the series has one slice only; a volume is needed");
  const Stack stack = order(slices);
  formats::RawImage raw;
  raw.grid.size = {slices.front().columns, slices.front().rows, static_cast<int>(slices.size())};
  formats::check_size(folder, raw.grid.size);
  raw.grid.origin_mm = position(slices.front());
  raw.axes.col(0) = stack.row * slices.front().spacing[1];
  raw.axes.col(1) = stack.column * slices.front().spacing[0];
  raw.axes.col(2) = stack.normal * stack.step_mm;
  raw.frame = "LPS";
  raw.voxels.reserve(raw.grid.count());
  volume.series.files.clear();
  for (const Slice& slice : slices) {
    append_pixels(slice, raw.voxels);
    volume.series.files.push_back(slice.file);
  }
  volume.file = formats::finish(folder, std::move(raw), "LPS");
  return volume;
}

}  // namespace

DicomVolume read_dicom(const fs::path& folder, const std::string& wanted) {
  // GDCM's assertions end the process on damaged files.
  check_survivable(folder, [&] { read_volume(folder, wanted); });
  return read_volume(folder, wanted);
}

}  // namespace supine::segmentation
