// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <teem/nrrd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>

#include "common/error.h"
#include "common/trial_process.h"
#include "segmentation/formats/data_file.h"
#include "segmentation/formats/image_formats.h"

namespace supine::segmentation::formats {
namespace {

struct IoStateDeleter {
  void operator()(NrrdIoState* state) const { nrrdIoStateNix(state); }
};
using IoState = std::unique_ptr<NrrdIoState, IoStateDeleter>;

struct NrrdDeleter {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
};
using NrrdPointer = std::unique_ptr<Nrrd, NrrdDeleter>;

std::string teem_error() {
  const std::unique_ptr<char, decltype(&std::free)> text(biffGetDone(NRRD), &std::free);
  std::string message = text ? text.get() : "unknown error";
  while (!message.empty() && message.back() == '\n') message.pop_back();
  const auto last = message.rfind('\n');  // the innermost cause is the last line
  return last == std::string::npos ? message : message.substr(last + 1);
}

std::optional<std::string> frame_of(const std::filesystem::path& file, const Nrrd& nrrd) {
  switch (nrrd.space) {
    case nrrdSpaceLeftPosteriorSuperior:
      return "LPS";
    case nrrdSpaceRightAnteriorSuperior:
      return "RAS";
    case nrrdSpaceLeftAnteriorSuperior:
      return "LAS";
    case nrrdSpaceUnknown:
    case nrrdSpaceScannerXYZ:
    case nrrdSpace3DRightHanded:
    case nrrdSpace3DLeftHanded:
      return std::nullopt;
    default:
      throw InputError(
          fmt::format("{}: space \"{}\" is not three-dimensional", file.string(), airEnumStr(nrrdSpace, nrrd.space)));
  }
}

void check_axes(const std::filesystem::path& file, const Nrrd& nrrd) {
  if (nrrd.dim != 3)
    throw InputError(fmt::format("{}: dimension {}; a scalar volume with 3 axes is needed (no colour, time or layers)",
                                 file.string(), nrrd.dim));
  for (int a = 0; a < 3; ++a) {
    const int kind = nrrd.axis[a].kind;
    if (kind != nrrdKindUnknown && kind != nrrdKindDomain && kind != nrrdKindSpace)
      throw InputError(fmt::format("{}: axis {} has kind \"{}\"; a scalar volume with 3 space axes is needed",
                                   file.string(), a, airEnumStr(nrrdKind, kind)));
  }
  if (nrrd.type == nrrdTypeBlock || nrrd.type == nrrdTypeUnknown)
    throw InputError(fmt::format("{}: the voxels are not numbers (type block)", file.string()));
  if (nrrd.spaceDim != 0 && nrrd.spaceDim != 3)
    throw InputError(fmt::format("{}: space dimension {}; 3 is needed", file.string(), nrrd.spaceDim));
  for (unsigned a = 0; a < nrrd.spaceDim; ++a) {
    const std::string unit = nrrd.spaceUnits[a] ? nrrd.spaceUnits[a] : "";
    if (!unit.empty() && unit != "mm" && unit != "millimeter" && unit != "millimetre")
      throw InputError(fmt::format("{}: space units \"{}\"; mm expected: scale space directions and space origin",
                                   file.string(), unit));
  }
}

void read_axes(const std::filesystem::path& file, const Nrrd& nrrd, RawImage& image) {
  image.axes.setZero();
  const bool placed = std::isfinite(nrrd.spaceDim == 3 ? nrrd.spaceOrigin[0] : nrrd.axis[0].min);
  if (!placed) image.warnings.push_back(no_origin(file, "space origin"));
  for (int a = 0; a < 3; ++a) {
    if (nrrd.spaceDim == 3) {
      for (int c = 0; c < 3; ++c) image.axes(c, a) = nrrd.axis[a].spaceDirection[c];
      const double origin = nrrd.spaceOrigin[a];
      image.grid.origin_mm[a] = std::isfinite(origin) ? origin : 0;
    } else {
      image.axes(a, a) = nrrd.axis[a].spacing;
      const double minimum = nrrd.axis[a].min;
      image.grid.origin_mm[a] = std::isfinite(minimum) ? minimum : 0;
    }
    if (!image.axes.col(a).allFinite())
      throw InputError(
          fmt::format("{}: axis {} has no spacing; give `space directions` or `spacings`", file.string(), a));
    // Without a space, a negative spacing would silently flip the patient.
    if (nrrd.spaceDim == 0 && image.axes(a, a) <= 0)
      throw InputError(
          fmt::format("{}: spacing of axis {} is {} mm; it must be > 0", file.string(), a, image.axes(a, a)));
  }
}

/// What holds the voxels: the file itself behind its header, or the file that the header names.
std::string voxel_bytes(const std::filesystem::path& file) {
  std::filesystem::path from = file;
  const auto detached = detached_data_file(file);
  if (detached) from = *detached;
  std::ifstream stream(from, std::ios::binary);
  std::string line;
  while (!detached && std::getline(stream, line) && !line.empty() && line != "\r") {
  }
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Teem takes what is left over, or packed otherwise than the header says, without a word: sizes or encoding are wrong
/// then.
void check_voxel_bytes(const std::filesystem::path& file, const Nrrd& header, const NrrdIoState& io) {
  if (io.dataFNArr->len > 1 || io.dataFNFormat != nullptr || io.byteSkip != 0 || io.lineSkip != 0) return;
  const std::string bytes = voxel_bytes(file);
  const std::size_t promised = nrrdElementNumber(&header) * nrrdElementSize(&header);
  const bool gzip = io.encoding == nrrdEncodingGzip, raw = io.encoding == nrrdEncodingRaw;
  if (gzip && !bytes.starts_with("\x1f\x8b"))
    throw InputError(fmt::format(
        "{}: its header says that the voxels are packed (encoding: gzip), and they are not; write the file again",
        file.string()));
  if (raw && bytes.size() != promised)
    throw InputError(
        fmt::format("{}: its header promises {} bytes of voxels, and {} follow: sizes, type or encoding "
                    "are not those of the data, or the file is truncated; write the file again",
                    file.string(), promised, bytes.size()));
  if (gzip) check_holdable(file, promised, bytes.size(), true);
  if (!gzip && !raw && io.encoding != nrrdEncodingBzip2 && nrrdElementNumber(&header) > bytes.size())
    check_holdable(file, nrrdElementNumber(&header), bytes.size(), false);
}

NrrdPointer load(const std::filesystem::path& file, bool header_only, NrrdIoState& io) {
  NrrdPointer nrrd(nrrdNew());
  io.skipData = header_only;
  if (nrrdLoad(nrrd.get(), file.c_str(), &io) != 0)
    throw InputError(
        fmt::format("{}: cannot be read as NRRD (damaged or truncated?): {}", file.string(), teem_error()));
  return nrrd;
}

/// Teem does not stand every damaged header, nor every damaged text or bzip2; bytes, plain or deflated, it does.
void try_loading(const std::filesystem::path& file) {
  check_survivable(file, [&file] {
    const IoState io(nrrdIoStateNew());
    load(file, true, *io);
    if (io->encoding != nrrdEncodingRaw && io->encoding != nrrdEncodingGzip)
      load(file, false, *IoState(nrrdIoStateNew()));
  });
}

}  // namespace

RawImage read_nrrd(const std::filesystem::path& file) {
  RawImage image;
  try_loading(file);
  {
    const IoState io(nrrdIoStateNew());
    const NrrdPointer header = load(file, true, *io);
    check_voxel_bytes(file, *header, *io);
    check_axes(file, *header);
    image.frame = frame_of(file, *header);
    for (int a = 0; a < 3; ++a)
      image.grid.size[a] =
          static_cast<int>(std::min<std::size_t>(header->axis[a].size, std::numeric_limits<int>::max()));
    check_size(file, image.grid.size);
    read_axes(file, *header, image);
  }
  const NrrdPointer nrrd = load(file, false, *IoState(nrrdIoStateNew()));
  image.voxels.resize(image.grid.count());
  const auto lookup = nrrdFLookup[nrrd->type];
  for (std::size_t n = 0; n < image.voxels.size(); ++n) image.voxels[n] = lookup(nrrd->data, n);
  return image;
}

}  // namespace supine::segmentation::formats
