// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/image_io.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "segmentation/formats/dicom_file.h"
#include "segmentation/formats/dicom_segmentation.h"
#include "segmentation/formats/image_formats.h"

namespace supine::segmentation {
namespace {

using formats::RawImage;

// Directions in files carry about six digits; beyond this the axes are sheared or not unit.
constexpr double orthonormal_tolerance = 1e-3;
// No breast is narrower; a volume in metres is about 0.2 wide.
constexpr double smallest_extent_mm = 3;

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

RawImage read_by_extension(const std::filesystem::path& file) {
  const std::string name = lower_case(file.filename().string());
  if (name.ends_with(".nrrd") || name.ends_with(".nhdr")) return formats::read_nrrd(file);
  if (name.ends_with(".mha") || name.ends_with(".mhd")) return formats::read_meta_image(file);
  if (name.ends_with(".nii") || name.ends_with(".nii.gz")) return formats::read_nifti(file);
  if (name.ends_with(".vti")) return formats::read_vti(file);
  if (formats::is_dicom(file)) return formats::read_dicom_segmentation(file);
  throw InputError(
      fmt::format("{}: unknown image format; known are .nrrd .nhdr .mha .mhd .nii .nii.gz .vti, a DICOM segmentation, "
                  "or the folder of a DICOM series",
                  file.string()));
}

/// Splits the axis steps into spacing and direction, checked.
void set_axes(const std::filesystem::path& file, const Eigen::Matrix3d& axes, Grid& grid) {
  for (int a = 0; a < 3; ++a) {
    grid.spacing_mm[a] = axes.col(a).norm();
    if (!(grid.spacing_mm[a] > 0) || !std::isfinite(grid.spacing_mm[a]))
      throw InputError(
          fmt::format("{}: spacing of axis {} is {} mm; it must be > 0", file.string(), a, grid.spacing_mm[a]));
    grid.direction.col(a) = axes.col(a) / grid.spacing_mm[a];
  }
  constexpr double most_unequal = 25;
  if (const double least = grid.spacing_mm.minCoeff(), most = grid.spacing_mm.maxCoeff(); most > most_unequal * least)
    throw InputError(
        fmt::format("{}: spacings of {:g} and {:g} mm in one volume (bound: a factor of {}): is one of them "
                    "in another unit, or not that axis's?",
                    file.string(), least, most, most_unequal));
  const double deviation =
      (grid.direction.transpose() * grid.direction - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(deviation <= orthonormal_tolerance))
    throw InputError(
        fmt::format("{}: the image axes are not at right angles (largest cosine {:.4g}, bound {}); resample the volume "
                    "onto a rectangular grid",
                    file.string(), deviation, orthonormal_tolerance));
  if (deviation > 1e-12) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(grid.direction, Eigen::ComputeFullU | Eigen::ComputeFullV);
    grid.direction = svd.matrixU() * svd.matrixV().transpose();
  }
}

void check_extent(const std::filesystem::path& file, const Grid& grid) {
  const double extent_mm = grid.size.cast<double>().cwiseProduct(grid.spacing_mm).maxCoeff();
  if (extent_mm < smallest_extent_mm)
    throw InputError(
        fmt::format("{}: the volume is only {:.4g} mm wide (at least {} expected); it seems to be in metres: scale "
                    "spacing and origin by 1000",
                    file.string(), extent_mm, smallest_extent_mm));
  if (!grid.origin_mm.allFinite()) throw InputError(fmt::format("{}: the origin is not finite", file.string()));
}

void check_finite(const std::filesystem::path& file, const GreyImage& image) {
  const auto bad = std::find_if(image.voxels.begin(), image.voxels.end(), [](float v) { return !std::isfinite(v); });
  if (bad == image.voxels.end()) return;
  const auto n = static_cast<std::size_t>(bad - image.voxels.begin());
  const auto row = static_cast<std::size_t>(image.grid.size.x()), slice = row * image.grid.size.y();
  throw InputError(fmt::format("{}: voxel ({}, {}, {}) is {}; every voxel must be a finite number", file.string(),
                               n % row, n % slice / row, n / slice, *bad));
}

void check_not_flat(const std::filesystem::path& file, const GreyImage& image) {
  const auto [low, high] = std::minmax_element(image.voxels.begin(), image.voxels.end());
  // labels.vti is read here too, and a body of one tissue that fills its grid is one.
  const bool may_be_labels = file.extension() == ".vti" && *low != 0;
  if (*low == *high && !may_be_labels)
    throw InputError(fmt::format("{}: every voxel is {}; the volume is empty: export it again", file.string(), *low));
}

Eigen::Vector3d frame_signs(const std::filesystem::path& file, const RawImage& raw, const std::string& case_frame) {
  if (!raw.frame && case_frame.empty())
    throw InputError(
        fmt::format("{}: the file names no patient frame; set case.frame to \"LPS\" or \"RAS\"", file.string()));
  const std::string& frame = raw.frame ? *raw.frame : case_frame;
  const auto signs = formats::signs_to_lps(frame);
  if (!signs)
    throw InputError(fmt::format("{}: frame \"{}\" is not known; LPS, RAS or LAS expected", file.string(), frame));
  return *signs;
}

}  // namespace

namespace formats {

std::optional<Eigen::Vector3d> signs_to_lps(const std::string& frame) {
  if (frame == "LPS") return Eigen::Vector3d(1, 1, 1);
  if (frame == "RAS") return Eigen::Vector3d(-1, -1, 1);
  if (frame == "LAS") return Eigen::Vector3d(1, -1, 1);
  return std::nullopt;
}

std::string no_origin(const std::filesystem::path& file, const std::string& key) {
  return fmt::format(
      "{}: has no {}, so its first voxel is taken to lie at 0, 0, 0; scans and landmarks must lie as it "
      "does. Where the origin is known, write it as {}",
      file.string(), key, key);
}

void check_size(const std::filesystem::path& file, const Eigen::Vector3i& size) {
  const double count = size.cast<double>().prod();
  if (size.minCoeff() < 1 || count > std::numeric_limits<int>::max())
    throw InputError(fmt::format("{}: size {} x {} x {}; each must be at least 1 and their product below 2^31",
                                 file.string(), size.x(), size.y(), size.z()));
}

void check_holdable(const std::filesystem::path& file, std::size_t promised, std::uintmax_t there, bool packed) {
  constexpr std::uintmax_t most_deflated = 1032;  // bytes that one byte of deflated data can stand for (zlib.net)
  if (promised <= there || (packed && promised / most_deflated <= there)) return;
  throw InputError(fmt::format(
      "{}: its header promises {} bytes of voxels, more than its {} bytes {}can hold: truncated or damaged; "
      "copy the file again",
      file.string(), promised, there, packed ? "of compressed data " : ""));
}

}  // namespace formats

ImageFile formats::finish(const std::filesystem::path& file, RawImage raw, const std::string& case_frame) {
  ImageFile result;
  const Eigen::Vector3d signs = frame_signs(file, raw, case_frame);
  Grid grid = raw.grid;
  set_axes(file, signs.asDiagonal() * raw.axes, grid);
  grid.origin_mm = signs.cwiseProduct(grid.origin_mm) + Eigen::Vector3d::Zero();  // -0 becomes 0
  check_extent(file, grid);
  result.image = {grid, std::move(raw.voxels)};
  check_finite(file, result.image);
  check_not_flat(file, result.image);
  result.frame = raw.frame.value_or("");
  result.warnings = std::move(raw.warnings);
  return result;
}

ImageFile read_image(const std::filesystem::path& file, const std::string& case_frame) {
  if (!std::filesystem::is_regular_file(file))
    throw InputError(fmt::format("{}: there is no such file", file.string()));
  return formats::finish(file, read_by_extension(file), case_frame);
}

}  // namespace supine::segmentation
