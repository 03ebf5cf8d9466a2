// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <memory>

#include "common/error.h"
#include "segmentation/formats/image_formats.h"
#include "segmentation/formats/samples.h"

// NIfTI-1 and -2 in one file. Read here because VTK's reader reorders slices by the sign of qfac; offsets are those of
// nifti1.h and nifti2.h.
namespace supine::segmentation::formats {
namespace {

struct GzClose {
  void operator()(gzFile_s* file) const { gzclose(file); }
};

/// The fields that matter, of either version.
struct Header {
  bool big_endian = false;
  std::int64_t dim[8] = {};
  int datatype = 0, bits = 0, unit = 0, qform_code = 0, sform_code = 0;
  double pixdim[8] = {};
  double data_offset = 0, slope = 0, intercept = 0;
  double quaternion[3] = {}, offset[3] = {};
  double rows[3][4] = {};
};

/// Reads numbers out of the header's bytes.
class Fields {
 public:
  Fields(const std::byte* bytes, bool big_endian)
      : bytes_(bytes), swap_(big_endian != (std::endian::native == std::endian::big)) {}
  template <class T>
  T get(std::size_t at) const {
    std::byte raw[sizeof(T)];
    std::memcpy(raw, bytes_ + at, sizeof(T));
    if (swap_) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }

 private:
  const std::byte* bytes_;
  bool swap_;
};

/// Where the two versions keep the same fields, and how wide they are.
template <class Real, class Size, class Code>
Header parse(const Fields& f, const std::array<std::size_t, 10>& at) {
  const auto [dim, datatype, pixdim, slope, code, quaternion, offset, rows, unit, bits] = at;
  Header h;
  for (int i = 0; i < 8; ++i) {
    h.dim[i] = f.get<Size>(dim + i * sizeof(Size));
    h.pixdim[i] = f.get<Real>(pixdim + i * sizeof(Real));
  }
  h.datatype = f.get<std::int16_t>(datatype);
  h.bits = f.get<std::int16_t>(bits);
  h.slope = f.get<Real>(slope);
  h.intercept = f.get<Real>(slope + sizeof(Real));
  h.qform_code = f.get<Code>(code);
  h.sform_code = f.get<Code>(code + sizeof(Code));
  for (int i = 0; i < 3; ++i) {
    h.quaternion[i] = f.get<Real>(quaternion + i * sizeof(Real));
    h.offset[i] = f.get<Real>(offset + i * sizeof(Real));
    for (int j = 0; j < 4; ++j) h.rows[i][j] = f.get<Real>(rows + (4 * i + j) * sizeof(Real));
  }
  h.unit = f.get<std::uint8_t>(unit) & 7;
  return h;
}

void read_exactly(gzFile_s* stream, const std::filesystem::path& file, std::byte* to, std::size_t wanted) {
  std::size_t done = 0;
  while (done < wanted) {
    const auto chunk = static_cast<unsigned>(std::min<std::size_t>(wanted - done, 1u << 30));
    const int got = gzread(stream, to + done, chunk);
    if (got <= 0)
      throw InputError(fmt::format("{}: the file ends after {} of {} bytes: truncated or damaged; copy it again",
                                   file.string(), done, wanted));
    done += static_cast<std::size_t>(got);
  }
}

/// What is left over is voxels of another size or type.
void check_ended(gzFile_s* stream, const std::filesystem::path& file, std::size_t promised) {
  std::byte more{};
  if (gzread(stream, &more, 1) > 0)
    throw InputError(
        fmt::format("{}: its header promises {} bytes of voxels, and more follow: dim, datatype or vox_offset are not "
                    "those of the data; write the file again",
                    file.string(), promised));
}

Header read_header(gzFile_s* stream, const std::filesystem::path& file) {
  std::byte bytes[540];
  read_exactly(stream, file, bytes, 348);
  for (const bool big_endian : {false, true}) {
    const Fields fields(bytes, big_endian);
    const auto version_size = fields.get<std::int32_t>(0);
    if (version_size != 348 && version_size != 540) continue;
    const bool first = version_size == 348;
    if (!first) read_exactly(stream, file, bytes + 348, 540 - 348);
    Header header =
        first ? parse<float, std::int16_t, std::int16_t>(fields, {40, 70, 76, 112, 252, 256, 268, 280, 123, 72})
              : parse<double, std::int64_t, std::int32_t>(fields, {16, 12, 104, 176, 344, 352, 376, 400, 500, 14});
    header.data_offset = first ? fields.get<float>(108) : static_cast<double>(fields.get<std::int64_t>(168));
    header.big_endian = big_endian;
    if (std::memcmp(bytes + (first ? 344 : 4), first ? "n+1" : "n+2", 3) != 0)
      throw InputError(fmt::format("{}: magic is not \"n+1\" or \"n+2\"; header and voxels must be in one .nii file",
                                   file.string()));
    return header;
  }
  throw InputError(fmt::format("{}: not a NIfTI file (sizeof_hdr is neither 348 nor 540)", file.string()));
}

SampleType sample_type(const std::filesystem::path& file, const Header& header) {
  static const std::map<int, SampleType> types = {
      {2, SampleType::u8},     {4, SampleType::i16},   {8, SampleType::i32},   {16, SampleType::f32},
      {64, SampleType::f64},   {256, SampleType::i8},  {512, SampleType::u16}, {768, SampleType::u32},
      {1024, SampleType::i64}, {1280, SampleType::u64}};
  const auto found = types.find(header.datatype);
  if (found == types.end())
    throw InputError(fmt::format("{}: datatype {} is not a scalar type this program reads (colour or complex?)",
                                 file.string(), header.datatype));
  const int bits = 8 * static_cast<int>(size_of(found->second));
  if (header.bits != 0 && header.bits != bits)  // 0: not filled in
    throw InputError(
        fmt::format("{}: bitpix is {} and datatype {} has {} bits: one of them is not that of the voxels; write the "
                    "file again",
                    file.string(), header.bits, header.datatype, bits));
  return found->second;
}

void check_kind(const std::filesystem::path& file, const Header& h) {
  const auto axes = h.dim[0];
  bool flat = axes >= 3 && axes <= 7;
  for (std::int64_t a = 4; flat && a <= axes; ++a) flat = h.dim[a] <= 1;
  if (!flat)
    throw InputError(fmt::format("{}: dim[0] = {}; one scalar volume with 3 axes is needed (no time, no colour)",
                                 file.string(), axes));
  if (h.unit == 1 || h.unit == 3)
    throw InputError(fmt::format("{}: xyzt_units says {}; mm expected: convert the file", file.string(),
                                 h.unit == 1 ? "metres" : "micrometres"));
}

/// The quaternion's rotation, third axis turned by qfac (nifti1.h, method 2).
Eigen::Matrix3d quaternion_axes(const Header& h) {
  const double b = h.quaternion[0], c = h.quaternion[1], d = h.quaternion[2];
  const double a = std::sqrt(std::max(0.0, 1 - (b * b + c * c + d * d)));
  Eigen::Matrix3d axes = Eigen::Quaterniond(a, b, c, d).normalized().toRotationMatrix();
  if (h.pixdim[0] < 0) axes.col(2) *= -1;
  for (int i = 0; i < 3; ++i) axes.col(i) *= h.pixdim[i + 1];
  return axes;
}

Eigen::Matrix4d sform(const Header& h) {
  Eigen::Matrix4d placed = Eigen::Matrix4d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) placed(r, c) = h.rows[r][c];
  return placed;
}

Eigen::Matrix4d qform(const Header& h) {
  Eigen::Matrix4d placed = Eigen::Matrix4d::Identity();
  placed.topLeftCorner<3, 3>() = quaternion_axes(h);
  for (int r = 0; r < 3; ++r) placed(r, 3) = h.offset[r];
  return placed;
}

/// A resampling that changed one of the two leaves a volume of another size.
void check_spacing(const std::filesystem::path& file, const Header& h) {
  const Eigen::Matrix4d placed = sform(h);
  for (int a = 0; a < 3; ++a) {
    const double step = placed.block<3, 1>(0, a).norm(), spacing = std::abs(h.pixdim[a + 1]);
    const double apart = std::abs(step - spacing) * static_cast<double>(h.dim[a + 1] - 1);
    if (spacing > 0 && apart > std::min(step, spacing))
      throw InputError(
          fmt::format("{}: pixdim[{}] is {} mm and column {} of the sform has steps of {:.6g} mm: one of them is not "
                      "the voxels' spacing; correct it, or write the volume again from its source",
                      file.string(), a + 1, h.pixdim[a + 1], a + 1, step));
  }
}

/// Furthest distance over the volume's corners between where sform and qform place them, mm.
double forms_apart(const Header& h) {
  const Eigen::Matrix4d between = sform(h) - qform(h);
  double furthest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector4d at(0, 0, 0, 1);
    for (int a = 0; a < 3; ++a)
      if ((corner >> a & 1) != 0) at[a] = static_cast<double>(h.dim[a + 1] - 1);
    furthest = std::max(furthest, (between * at).norm());
  }
  return furthest;
}

void place(const std::filesystem::path& file, const Header& h, RawImage& image) {
  if (h.sform_code > 0) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) image.axes(r, c) = h.rows[r][c];
      image.grid.origin_mm[r] = h.rows[r][3];
    }
    image.frame = "RAS";
    check_spacing(file, h);
    const double apart = h.qform_code > 0 ? forms_apart(h) : 0, voxel = image.axes.colwise().norm().minCoeff();
    if (apart > voxel)
      image.warnings.push_back(
          fmt::format("{}: sform (code {}) and qform (code {}) place the volume up to {:.1f} mm apart; the sform is "
                      "taken. If the qform is right, set sform_code to 0",
                      file.string(), h.sform_code, h.qform_code, apart));
    return;
  }
  for (int a = 1; a <= 3; ++a)
    if (!(h.pixdim[a] > 0))
      throw InputError(fmt::format("{}: spacing pixdim[{}] is {} mm; it must be > 0", file.string(), a, h.pixdim[a]));
  if (h.qform_code > 0) {
    image.axes = quaternion_axes(h);
    image.grid.origin_mm = {h.offset[0], h.offset[1], h.offset[2]};
    image.frame = "RAS";
    return;
  }
  image.axes = Eigen::Vector3d(h.pixdim[1], h.pixdim[2], h.pixdim[3]).asDiagonal();
  image.warnings.push_back(
      fmt::format("{}: sform_code and qform_code are 0, so the file does not say how it lies in the patient; its axes "
                  "are taken as x, y, z of "
                  "case.frame with the first voxel at the origin",
                  file.string()));
}

}  // namespace

RawImage read_nifti(const std::filesystem::path& file) {
  const std::unique_ptr<gzFile_s, GzClose> stream(gzopen(file.c_str(), "rb"));
  if (!stream) throw InputError(fmt::format("{}: cannot be opened", file.string()));
  const Header h = read_header(stream.get(), file);
  check_kind(file, h);
  const SampleType type = sample_type(file, h);
  RawImage image;
  for (int a = 0; a < 3; ++a)
    image.grid.size[a] = static_cast<int>(std::clamp<std::int64_t>(h.dim[a + 1], 0, 2000000000));
  check_size(file, image.grid.size);
  place(file, h, image);
  const std::size_t wanted = image.grid.count() * size_of(type);
  check_holdable(file, wanted, std::filesystem::file_size(file), gzdirect(stream.get()) == 0);
  if (!(h.data_offset >= 0 && h.data_offset < std::numeric_limits<z_off_t>::max() / 2))
    throw InputError(
        fmt::format("{}: vox_offset is {}; the voxels must begin behind the header", file.string(), h.data_offset));
  if (gzseek(stream.get(), static_cast<z_off_t>(h.data_offset), SEEK_SET) < 0)
    throw InputError(fmt::format("{}: vox_offset {} lies beyond the end of the file", file.string(), h.data_offset));
  std::vector<std::byte> bytes(wanted);
  read_exactly(stream.get(), file, bytes.data(), bytes.size());
  check_ended(stream.get(), file, wanted);
  image.voxels = to_floats(bytes, type, h.big_endian);
  if (h.slope != 0 && (h.slope != 1 || h.intercept != 0))
    for (float& v : image.voxels) v = static_cast<float>(h.slope * v + h.intercept);
  return image;
}

}  // namespace supine::segmentation::formats
