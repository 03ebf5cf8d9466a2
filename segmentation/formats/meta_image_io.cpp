// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>

#include "common/error.h"
#include "segmentation/formats/image_formats.h"
#include "segmentation/formats/samples.h"

// VTK 9.1's MetaImage reader drops TransformMatrix, so header and voxels are read here.
namespace supine::segmentation::formats {
namespace {

struct Header {
  std::filesystem::path file;
  std::map<std::string, std::string> values;
  std::streamoff data_start = 0;  ///< first byte after the header

  const std::string* find(std::initializer_list<const char*> keys) const {
    for (const char* key : keys)
      if (const auto found = values.find(key); found != values.end()) return &found->second;
    return nullptr;
  }
  [[noreturn]] void refuse(const std::string& key, const std::string& why) const {
    const std::string* value = find({key.c_str()});
    throw InputError(fmt::format("{}: {} = {}: {}", file.string(), key, value ? *value : "(missing)", why));
  }
  bool flag(std::initializer_list<const char*> keys) const {
    const std::string* value = find(keys);
    return value && !value->empty() && (value->front() == 'T' || value->front() == 't' || value->front() == '1');
  }
  /// The numbers behind the first of @p keys that is there; empty when none is.
  std::vector<double> numbers(std::initializer_list<const char*> keys, std::size_t count) const;
};

std::vector<double> Header::numbers(std::initializer_list<const char*> keys, std::size_t count) const {
  std::vector<double> result;
  const std::string* value = find(keys);
  if (!value) return result;
  const char *at = value->data(), *end = at + value->size();
  while (at < end) {
    if (*at == ' ' || *at == '\t') {
      ++at;
      continue;
    }
    double number = 0;
    const auto parsed = std::from_chars(at, end, number);
    if (parsed.ec != std::errc() || !std::isfinite(number)) break;
    result.push_back(number);
    at = parsed.ptr;
  }
  if (at != end || result.size() != count)
    throw InputError(fmt::format("{}: {} = {}: {} numbers expected", file.string(), *keys.begin(), *value, count));
  return result;
}

std::string trim(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

Header read_header(const std::filesystem::path& file) {
  Header header;
  header.file = file;
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  while (line.size() < 100000 && std::getline(stream, line)) {
    const auto equals = line.find('=');
    if (equals == std::string::npos) break;
    const std::string key = trim(line.substr(0, equals));
    header.values[key] = trim(line.substr(equals + 1));
    if (key == "ElementDataFile") {
      header.data_start = stream.tellg();
      return header;
    }
  }
  throw InputError(
      fmt::format("{}: not a MetaImage header (lines `key = value` up to ElementDataFile)", file.string()));
}

SampleType sample_type(const Header& header) {
  static const std::map<std::string, SampleType> types = {
      {"MET_UCHAR", SampleType::u8},      {"MET_CHAR", SampleType::i8},   {"MET_USHORT", SampleType::u16},
      {"MET_SHORT", SampleType::i16},     {"MET_UINT", SampleType::u32},  {"MET_INT", SampleType::i32},
      {"MET_ULONG", SampleType::u32},     {"MET_LONG", SampleType::i32},  {"MET_ULONG_LONG", SampleType::u64},
      {"MET_LONG_LONG", SampleType::i64}, {"MET_FLOAT", SampleType::f32}, {"MET_DOUBLE", SampleType::f64}};
  const std::string* name = header.find({"ElementType"});
  const auto found = name ? types.find(*name) : types.end();
  if (found == types.end())
    header.refuse("ElementType", "a scalar type such as MET_UCHAR, MET_SHORT or MET_FLOAT is needed");
  return found->second;
}

/// What is left over is voxels of another size or type.
[[noreturn]] void refuse_surplus(const std::filesystem::path& file, std::size_t promised, const std::string& there) {
  throw InputError(
      fmt::format("{}: the header promises {} bytes of voxels, and {} follow: DimSize, ElementType or HeaderSize are "
                  "not those of the data; write the file again",
                  file.string(), promised, there));
}

std::vector<std::byte> inflate_bytes(const Header& header, const std::vector<std::byte>& packed, std::size_t wanted) {
  std::vector<std::byte> bytes(wanted);
  z_stream stream{};
  // 32: zlib or gzip, found out from the data
  inflateInit2(&stream, 15 + 32);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  std::size_t done = 0;
  int status = Z_OK;
  while (status == Z_OK && done < wanted) {
    const std::size_t room = std::min<std::size_t>(wanted - done, 1u << 30);
    stream.next_out = reinterpret_cast<Bytef*>(bytes.data() + done);
    stream.avail_out = static_cast<uInt>(room);
    status = inflate(&stream, Z_NO_FLUSH);
    done += room - stream.avail_out;
  }
  std::byte more{};
  stream.next_out = reinterpret_cast<Bytef*>(&more);
  stream.avail_out = 1;
  if (done == wanted && status == Z_OK) inflate(&stream, Z_NO_FLUSH);
  const bool left_over = stream.avail_out == 0;
  inflateEnd(&stream);
  if (done == wanted && left_over) refuse_surplus(header.file, wanted, "more");
  if (done != wanted)
    throw InputError(
        fmt::format("{}: the compressed voxel data end after {} of {} bytes: truncated or damaged; copy the file again",
                    header.file.string(), done, wanted));
  return bytes;
}

std::vector<std::byte> read_bytes(const Header& header, std::size_t wanted) {
  const std::string& name = header.values.at("ElementDataFile");
  const bool local = name == "LOCAL" || name == "Local" || name == "local";
  if (name.starts_with("LIST") || name.find('%') != std::string::npos)
    header.refuse("ElementDataFile", "one file per slice is not read; save the volume as one file");
  const auto data_file = local ? header.file : header.file.parent_path() / name;
  std::ifstream stream(data_file, std::ios::binary | std::ios::ate);
  if (!stream) header.refuse("ElementDataFile", "the file with the voxels cannot be read");
  const std::streamoff size = stream.tellg();
  const bool compressed = header.flag({"CompressedData"});
  std::streamoff start = local ? header.data_start : 0;
  if (const auto skip = header.numbers({"HeaderSize"}, 1); !skip.empty()) {
    if (!(skip[0] >= -1 && skip[0] <= static_cast<double>(size)))
      header.refuse("HeaderSize", fmt::format("-1, or 0 to the size of the file ({} bytes)", size));
    start = skip[0] < 0 ? size - static_cast<std::streamoff>(wanted) : start + static_cast<std::streamoff>(skip[0]);
  }
  if (start < 0 || start > size || (!compressed && static_cast<std::size_t>(size - start) < wanted))
    throw InputError(fmt::format("{}: {} bytes of voxel data expected, {} found: truncated; copy the file again",
                                 data_file.string(), wanted,
                                 std::max<std::streamoff>(0, size - std::max<std::streamoff>(0, start))));
  if (!compressed && static_cast<std::size_t>(size - start) > wanted)
    refuse_surplus(data_file, wanted, fmt::format("{}", size - start));
  check_holdable(data_file, wanted, static_cast<std::uintmax_t>(size - start), compressed);
  std::vector<std::byte> bytes(compressed ? static_cast<std::size_t>(size - start) : wanted);
  stream.seekg(start);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return compressed ? inflate_bytes(header, bytes, wanted) : bytes;
}

void check_kind(const Header& header) {
  const auto refuse_unless = [&header](const char* key, double expected, const char* why) {
    const auto value = header.numbers({key}, 1);
    if (!value.empty() && value[0] != expected) header.refuse(key, why);
  };
  refuse_unless("NDims", 3, "a volume with 3 axes is needed");
  refuse_unless("ElementNumberOfChannels", 1, "a scalar volume is needed, not colour");
  if (header.find({"BinaryData"}) && !header.flag({"BinaryData"}))
    header.refuse("BinaryData", "text voxels are not read; save the volume as binary");
}

/// The spacing stands in ElementSpacing alone: in both it would count twice.
void check_unit_rows(const Header& header, const Eigen::Matrix3d& direction, const std::vector<double>& spacing) {
  constexpr double few_digits = 0.01;
  for (int a = 0; a < 3; ++a)
    if (const double length = direction.col(a).norm(); !(std::abs(length - 1) <= few_digits))
      throw InputError(fmt::format(
          "{}: row {} of TransformMatrix has the length {:.6g}, beside the ElementSpacing {} mm: a row is a "
          "direction, its length must be 1; divide the row by its length, and see that ElementSpacing is "
          "the spacing",
          header.file.string(), a + 1, length, spacing[static_cast<std::size_t>(a)]));
}

/// What AnatomicalOrientation says of the frame. Its three letters name, per axis, the side the axis comes from (ITK)
/// or goes to (others); with the matrix known, at most one frame agrees with either habit.
std::optional<std::string> frame_of(const Header& header, const Eigen::Matrix3d& direction) {
  const std::string* letters = header.find({"AnatomicalOrientation"});
  if (!letters || letters->size() != 3 || letters->find('?') != std::string::npos) return std::nullopt;
  static constexpr std::array<std::array<char, 2>, 3> sides = {{{'R', 'L'}, {'A', 'P'}, {'I', 'S'}}};  // LPS: from, to
  for (const char* frame : {"LPS", "RAS"}) {
    const Eigen::Matrix3d lps = signs_to_lps(frame)->asDiagonal() * direction;
    std::string from, to;
    for (int a = 0; a < 3; ++a) {
      int c = 0;
      if (lps.col(a).cwiseAbs().maxCoeff(&c) < 0.8) return std::nullopt;  // oblique: the letters are a matter of taste
      const bool forward = lps(c, a) > 0;
      from += sides[c][forward ? 0 : 1];
      to += sides[c][forward ? 1 : 0];
    }
    if (*letters == from || *letters == to) return frame;
  }
  header.refuse("AnatomicalOrientation",
                "contradicts TransformMatrix in LPS and in RAS; correct one of them, or delete the line "
                "so that case.frame holds");
}

}  // namespace

RawImage read_meta_image(const std::filesystem::path& file) {
  const Header header = read_header(file);
  check_kind(header);
  RawImage image;
  const auto size = header.numbers({"DimSize"}, 3);
  if (size.empty()) header.refuse("DimSize", "the number of voxels along each axis is needed");
  for (int a = 0; a < 3; ++a) image.grid.size[a] = static_cast<int>(std::clamp(size[a], 0.0, 2e9));
  check_size(file, image.grid.size);
  const auto spacing = header.numbers({"ElementSpacing", "ElementSize"}, 3);
  if (spacing.empty()) header.refuse("ElementSpacing", "the spacing in mm is needed");
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  if (const auto matrix = header.numbers({"TransformMatrix", "Rotation", "Orientation"}, 9); !matrix.empty()) {
    direction = Eigen::Map<const Eigen::Matrix3d>(matrix.data());  // written axis by axis: column a = axis a
    check_unit_rows(header, direction, spacing);
  }
  for (int a = 0; a < 3; ++a) {
    if (!(spacing[a] > 0)) header.refuse("ElementSpacing", "spacings must be > 0 mm");
    image.axes.col(a) = direction.col(a) * spacing[a];
  }
  if (const auto origin = header.numbers({"Offset", "Position", "Origin"}, 3); !origin.empty())
    image.grid.origin_mm = Eigen::Map<const Eigen::Vector3d>(origin.data());
  else
    image.warnings.push_back(no_origin(file, "Offset"));
  image.frame = frame_of(header, direction);
  const SampleType type = sample_type(header);
  const bool big_endian = header.flag({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"});
  image.voxels = to_floats(read_bytes(header, image.grid.count() * size_of(type)), type, big_endian);
  return image;
}

}  // namespace supine::segmentation::formats
