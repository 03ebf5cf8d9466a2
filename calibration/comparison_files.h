// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "calibration/compare.h"

namespace supine::calibration {

/// Writes the model's skin: triangles with the point arrays `distance_mm` (signed, model → scan), `covered` (0, 1),
/// `area_name` (string) and `area` (int, its row in the field data `area_names`; the last three words only when the
/// comparison has areas). Field data `frame` = LPS, `unit` = mm. The same comparison gives the same bytes.
/// @throws InputError  when the file cannot be written
void write_comparison(const Comparison& comparison, const ModelSkin& model, const SkinAreas& areas,
                      const std::filesystem::path& file);

/// Writes the scan: its triangles (oriented outward), or a vertex per point, with the point arrays `distance_mm`
/// (signed, scan → model) and `used` (0 beyond the model).
/// @throws InputError  when the file cannot be written
void write_scan(const Comparison& comparison, const Scan& scan, const std::filesystem::path& file);

}  // namespace supine::calibration
