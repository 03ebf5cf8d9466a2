// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "segmentation/formats/image_io.h"

namespace supine::segmentation {

/// One series of a DICOM folder, by its headers.
struct DicomSeries {
  std::string uid;                           ///< (0020,000e)
  std::string number;                        ///< (0020,0011)
  std::string description;                   ///< (0008,103e)
  std::string modality;                      ///< (0008,0060)
  std::string patient_position;              ///< (0018,5100): HFP, FFP, HFS, ...; empty when not said
  std::string laterality;                    ///< L, R or empty: (0020,0062), else (0020,0060)
  std::vector<std::filesystem::path> files;  ///< in the order of their names
};

/// The series of a folder and of the folders inside it, in the order of number, then uid. Files that are not DICOM or
/// hold no image are passed over.
/// @throws InputError  when the folder cannot be read or holds no DICOM image
std::vector<DicomSeries> list_dicom_series(const std::filesystem::path& folder);

/// A line per series for a person: number, description, modality, slices, uid.
std::string describe_series(const std::vector<DicomSeries>& series);

struct DicomVolume {
  ImageFile file;      ///< LPS by definition of DICOM; greys are the rescaled values
  DicomSeries series;  ///< its files in the order of the slices
};

/// Reads one series as a volume. Rows, columns and slices become the axes i, j, k; slices are ordered along the normal
/// of (0020,0037) by their (0020,0032), names and instance numbers do not count.
/// @param wanted  uid, number or description of the series; empty when the folder holds only one
/// @throws InputError  saying which: no series, several and none chosen (lists them), none or several fit `wanted`,
///   a file that is cut short, one slice only, colour, several frames in a file, slices of different size, orientation,
///   pixel spacing or frame of reference (mixed), several slices in one place (4-D: with how many, where), a missing
///   slice (between which mm), uneven spacing, gantry tilt, and as read_image
DicomVolume read_dicom(const std::filesystem::path& folder, const std::string& wanted);

}  // namespace supine::segmentation
