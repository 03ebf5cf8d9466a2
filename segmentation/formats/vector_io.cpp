// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/vector_io.h"

#include <fmt/format.h>
#include <teem/nrrd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "common/error.h"
#include "segmentation/formats/nifti_writer.h"

namespace supine::segmentation {
namespace {

using formats::SampleType;

[[noreturn]] void fail(const std::filesystem::path& file) {
  throw InputError(fmt::format("{}: cannot be written; check the folder and the free space", file.string()));
}

/// A temporary name keeps only the last extension.
bool is_nifti(const std::filesystem::path& file) { return file.extension() == ".nii" || file.extension() == ".gz"; }

SampleType smallest_type(const std::vector<float>& voxels) {
  float low = 0, high = 0;
  for (const float v : voxels) {
    if (v != std::nearbyint(v)) return SampleType::f32;
    low = std::min(low, v), high = std::max(high, v);
  }
  if (low >= 0 && high <= 255) return SampleType::u8;
  if (low >= -32768 && high <= 32767) return SampleType::i16;
  if (low >= 0 && high <= 65535) return SampleType::u16;
  constexpr float whole = 1 << 24;  // beyond it float holds no longer every whole number
  return low >= -whole && high <= whole ? SampleType::i32 : SampleType::f32;
}

template <class T>
std::vector<std::byte> stored_as(const std::vector<float>& voxels) {
  std::vector<std::byte> bytes(voxels.size() * sizeof(T));
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    const T value = static_cast<T>(voxels[n]);
    std::memcpy(bytes.data() + n * sizeof(T), &value, sizeof(T));
  }
  return bytes;
}

std::vector<std::byte> to_bytes(const std::vector<float>& voxels, SampleType type) {
  switch (type) {
    case SampleType::u8:
      return stored_as<std::uint8_t>(voxels);
    case SampleType::i16:
      return stored_as<std::int16_t>(voxels);
    case SampleType::u16:
      return stored_as<std::uint16_t>(voxels);
    case SampleType::i32:
      return stored_as<std::int32_t>(voxels);
    default:
      return stored_as<float>(voxels);
  }
}

int nrrd_type(SampleType type) {
  switch (type) {
    case SampleType::u8:
      return nrrdTypeUChar;
    case SampleType::i16:
      return nrrdTypeShort;
    case SampleType::u16:
      return nrrdTypeUShort;
    case SampleType::i32:
      return nrrdTypeInt;
    default:
      return nrrdTypeFloat;
  }
}

/// Writes @p data, which stays the caller's; @p components axes of vectors come first when there are several.
void save_nrrd(const void* data, SampleType type, int components, const Grid& grid, const std::filesystem::path& file) {
  const auto forget = [](Nrrd* nrrd) { nrrdNix(nrrd); };
  const std::unique_ptr<Nrrd, decltype(forget)> nrrd(nrrdNew(), forget);
  const unsigned first = components > 1 ? 1 : 0;
  std::size_t size[4] = {static_cast<std::size_t>(components)};
  for (int a = 0; a < 3; ++a) size[first + static_cast<unsigned>(a)] = static_cast<std::size_t>(grid.size[a]);
  bool good = nrrdWrap_nva(nrrd.get(), const_cast<void*>(data), nrrd_type(type), 3 + first, size) == 0;
  good = good && nrrdSpaceSet(nrrd.get(), nrrdSpaceLeftPosteriorSuperior) == 0;
  if (!good) fail(file);
  if (first) nrrd->axis[0].kind = nrrdKindVector;
  for (unsigned a = 0; a < 3; ++a) {
    NrrdAxisInfo& axis = nrrd->axis[first + a];
    axis.kind = nrrdKindDomain;
    axis.center = nrrdCenterCell;
    for (int c = 0; c < 3; ++c) axis.spaceDirection[c] = grid.direction(c, a) * grid.spacing_mm[a];
    nrrd->spaceOrigin[a] = grid.origin_mm[a];
    if (first)
      for (unsigned c = 0; c < 3; ++c) nrrd->measurementFrame[a][c] = a == c;
  }
  const auto leave = [](NrrdIoState* io) { nrrdIoStateNix(io); };
  const std::unique_ptr<NrrdIoState, decltype(leave)> io(nrrdIoStateNew(), leave);
  if (nrrdIoStateEncodingSet(io.get(), nrrdEncodingGzip) != 0) fail(file);
  io->zlibLevel = 1;  // a third larger than the best, five times as fast
  if (nrrdSave(file.c_str(), nrrd.get(), io.get()) != 0) fail(file);
}

}  // namespace

void write_image(const GreyImage& image, const std::filesystem::path& file) {
  const SampleType type = smallest_type(image.voxels);
  const bool nrrd = file.extension() == ".nrrd";
  if (!nrrd && !is_nifti(file))
    throw InputError(fmt::format("{}: volumes are written as .nrrd, .nii or .nii.gz", file.string()));
  const std::vector<std::byte> bytes = to_bytes(image.voxels, type);
  if (nrrd) return save_nrrd(bytes.data(), type, 1, image.grid, file);
  if (!formats::write_nifti(image.grid, bytes, type, 1, file)) fail(file);
}

void write_vectors(const VectorImage& image, const std::filesystem::path& file) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  if (file.extension() == ".nrrd") return save_nrrd(image.vectors.data(), SampleType::f32, 3, image.grid, file);
  if (!is_nifti(file)) throw InputError(fmt::format("{}: fields are written as .nrrd, .nii or .nii.gz", file.string()));
  // NIfTI keeps one component after the other.
  std::vector<float> planes(3 * image.vectors.size());
  for (std::size_t n = 0; n < image.vectors.size(); ++n)
    for (int c = 0; c < 3; ++c) planes[static_cast<std::size_t>(c) * image.vectors.size() + n] = image.vectors[n][c];
  if (!formats::write_nifti(image.grid, std::as_bytes(std::span(planes)), SampleType::f32, 3, file)) fail(file);
}

}  // namespace supine::segmentation
