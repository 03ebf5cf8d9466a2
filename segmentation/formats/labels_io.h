// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "segmentation/image.h"
#include "segmentation/support_voxels.h"

namespace supine::segmentation {

/// What the case says about its labels beyond the voxels, carried along as string field data: `cut` (comma list of
/// excluded, edge, rim), `rim_mm` and `side` (left, right or both).
using LabelNotes = std::map<std::string, std::string>;

/// Writes labels.vti: points at the voxel centres with the uint8 point array `tissue`; field data `frame` = "LPS",
/// `unit` = "mm", `tissue_names` (index = value) and the notes; with @p gland_share the float point array
/// `fraction_gland` too, with @p supports the uint8 point array `support` (0 for none, n for the n-th name) and field
/// data `support_names`; VTK's direction matrix holds the direction. Same image, same bytes.
/// @throws InputError  when the file cannot be written
void write_labels(const LabelImage& labels, const std::filesystem::path& file, const LabelNotes& notes = {},
                  const std::vector<float>& gland_share = {}, const SupportVoxels& supports = {});

/// Reads what write_labels wrote; frame RAS is converted.
/// @throws InputError  as read_image; also when there is no point array `tissue` or a value is not a Tissue
LabelImage read_labels(const std::filesystem::path& file);

/// The point array `fraction_gland`: share of gland per voxel; empty when the file has none.
/// @throws InputError  as read_image; a share outside 0 to 1
std::vector<float> read_gland_share(const std::filesystem::path& file);

/// The supports that have names; none when the file names none.
/// @throws InputError  as read_image; names without the array, a number in it that no name belongs to, no voxel of any
SupportVoxels read_label_supports(const std::filesystem::path& file);

/// The notes `cut`, `rim_mm` and `side` of a .vti, as far as it has them. @throws InputError  as read_image
LabelNotes read_label_notes(const std::filesystem::path& file);

}  // namespace supine::segmentation
