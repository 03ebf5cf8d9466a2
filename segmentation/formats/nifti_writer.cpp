// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/nifti_writer.h"

#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

namespace supine::segmentation::formats {
namespace {

static_assert(std::endian::native == std::endian::little, "headers are written as they lie in memory");

// Offsets and codes are those of nifti1.h.
constexpr std::size_t header_bytes = 352;  // with the four of "no extension"
constexpr std::int16_t intent_vector = 1007, scanner_anatomy = 1;
constexpr char millimetres = 2;

std::int16_t datatype(SampleType type) {
  switch (type) {
    case SampleType::u8:
      return 2;
    case SampleType::i16:
      return 4;
    case SampleType::u16:
      return 512;
    case SampleType::i32:
      return 8;
    default:
      return 16;
  }
}

class Header {
 public:
  template <class T>
  void set(std::size_t at, T value) {
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }
  const std::array<char, header_bytes>& bytes() const { return bytes_; }

 private:
  std::array<char, header_bytes> bytes_{};
};

/// sform, and the qform of a grid without mirrored axes, in RAS.
void place(const Grid& grid, Header& header) {
  const Eigen::Vector3d to_ras(-1, -1, 1);
  const Eigen::Matrix3d axes = to_ras.asDiagonal() * grid.direction;
  const Eigen::Vector3d origin = to_ras.cwiseProduct(grid.origin_mm);
  header.set<std::int16_t>(254, scanner_anatomy);
  for (std::size_t r = 0; r < 3; ++r) {
    const auto row = static_cast<Eigen::Index>(r);
    for (std::size_t c = 0; c < 3; ++c)
      header.set(280 + 16 * r + 4 * c, static_cast<float>(axes(row, static_cast<Eigen::Index>(c)) *
                                                          grid.spacing_mm[static_cast<Eigen::Index>(c)]));
    header.set(280 + 16 * r + 12, static_cast<float>(origin[row]));
    header.set(268 + 4 * r, static_cast<float>(origin[row]));
  }
  // A mirrored frame turns its third axis round by qfac (nifti1.h, method 2).
  const bool mirrored = axes.determinant() < 0;
  Eigen::Matrix3d rotation = axes;
  if (mirrored) rotation.col(2) *= -1;
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() *= -1;
  header.set<std::int16_t>(252, scanner_anatomy);
  header.set(76, mirrored ? -1.0F : 1.0F);
  for (std::size_t c = 0; c < 3; ++c)
    header.set(256 + 4 * c, static_cast<float>(q.vec()[static_cast<Eigen::Index>(c)]));
}

Header header_of(const Grid& grid, SampleType type, int components) {
  Header header;
  header.set<std::int32_t>(0, 348);
  const std::int16_t axes = components > 1 ? 5 : 3;
  header.set(40, axes);
  for (std::size_t a = 0; a < 7; ++a) {
    const bool space = a < 3;
    const int size = space ? grid.size[static_cast<Eigen::Index>(a)] : a == 4 ? components : 1;
    header.set(42 + 2 * a, static_cast<std::int16_t>(size));
    header.set(80 + 4 * a, space ? static_cast<float>(grid.spacing_mm[static_cast<Eigen::Index>(a)]) : 1.0F);
  }
  if (components > 1) header.set(68, intent_vector);
  header.set(70, datatype(type));
  header.set(72, static_cast<std::int16_t>(8 * size_of(type)));
  header.set(108, static_cast<float>(header_bytes));
  header.set(112, 1.0F);
  header.set(123, millimetres);
  place(grid, header);
  header.set<std::array<char, 4>>(344, {'n', '+', '1', '\0'});
  return header;
}

bool write_all(gzFile_s* stream, const void* data, std::size_t size) {
  const auto* at = static_cast<const char*>(data);
  while (size > 0) {
    const auto piece = static_cast<unsigned>(std::min<std::size_t>(size, 1U << 28));
    if (gzwrite(stream, at, piece) != static_cast<int>(piece)) return false;
    at += piece, size -= piece;
  }
  return true;
}

}  // namespace

bool write_nifti(const Grid& grid, std::span<const std::byte> bytes, SampleType type, int components,
                 const std::filesystem::path& file) {
  // "T": no compression at all.
  gzFile_s* stream = gzopen(file.c_str(), file.extension() == ".gz" ? "wb1" : "wbT");
  if (!stream) return false;
  const Header header = header_of(grid, type, components);
  const bool written =
      write_all(stream, header.bytes().data(), header_bytes) && write_all(stream, bytes.data(), bytes.size());
  return gzclose(stream) == Z_OK && written;
}

}  // namespace supine::segmentation::formats
