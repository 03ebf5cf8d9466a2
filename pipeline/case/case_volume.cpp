// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case_volume.h"

#include <fmt/format.h>

#include "common/error.h"
#include "pipeline/case/patient_frame.h"
#include "segmentation/formats/data_file.h"
#include "segmentation/formats/dicom_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

/// A DICOM series, checked against what the case says about the patient.
segmentation::ImageFile read_series(Run& run, const Case& measured, const fs::path& folder) {
  segmentation::DicomVolume volume = segmentation::read_dicom(folder, measured.image_series);
  for (const fs::path& file : volume.series.files) run.input(file);
  const std::string& position = volume.series.patient_position;
  const bool prone = position == "HFP" || position == "FFP", supine = position == "HFS" || position == "FFS";
  const double falls_back = measured.imaged().gravity.y();  // LPS: +y is the patient's back
  if ((prone && falls_back > 0) || (supine && falls_back < 0))
    throw InputError(fmt::format(
        "{}: the series was taken with the patient {} (patient position {}), but [pose.{}] gravity in case.toml "
        "points to the patient's {}; choose the series of the {} examination, or correct gravity or frame",
        folder.string(), prone ? "prone" : "supine", position, measured.imaged_pose, falls_back > 0 ? "back" : "front",
        measured.imaged_pose));
  if (position.empty()) run.warn("the series does not say how the patient lay (0018,5100)");
  const std::string side = volume.series.laterality == "L" ? "left" : volume.series.laterality == "R" ? "right" : "";
  if (!side.empty() && !measured.is_object() && measured.side != side)
    throw InputError(fmt::format("{}: the series shows the {} breast only (laterality {}), but case.side is \"{}\"",
                                 folder.string(), side, volume.series.laterality, measured.side));
  for (const auto& warning : volume.file.warnings) run.warn(warning);
  return std::move(volume.file);
}

}  // namespace

segmentation::ImageFile read_case_volume(Run& run, const Case& measured, const fs::path& file) {
  if (fs::is_directory(file)) return read_series(run, measured, file);
  const bool turned = !measured.image_frame.empty();
  segmentation::ImageFile volume = segmentation::read_image(run.input(file), turned ? "LPS" : measured.frame);
  if (turned && volume.frame.empty())
    volume.image.grid = in_lps(volume.image.grid, *axes_of_frame(measured.image_frame));
  if (const auto voxels = segmentation::detached_data_file(file)) run.input(*voxels);
  for (const auto& warning : volume.warnings) run.warn(warning);
  return volume;
}

}  // namespace supine::pipeline
