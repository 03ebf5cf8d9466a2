// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "calibration/residuals.h"
#include "diagnosis/candidates.h"
#include "diagnosis/force_map.h"
#include "diagnosis/hot_spots.h"

namespace supine::diagnosis {

/// Writes the fitted scan points with the point arrays `distance_mm`, `pose` (row of the field data `poses`) and, per
/// candidate, `shape_<effect>_mm`: the change of distance that the effect at its one-step size would make, its
/// parameters in the order of the table. Field data `frame` = LPS, `unit` = mm. Same input, same bytes.
/// With @p forces also the vectors `missing_force_kpa` and, of one simulated measurement of a model that lacks nothing,
/// `missing_force_null_kpa`; field data `missing_force_threshold_kpa`, and `missing_force_meaning`, which says that
/// this is a hint.
/// @param shapes  per candidate, #R   @param forces  nullptr where there is none
/// @throws InputError  when the file cannot be written
void write_diagnosis(const calibration::Residuals& residuals, const std::vector<std::string>& poses,
                     const std::vector<std::pair<std::string, Eigen::VectorXd>>& shapes, const ForceMap* forces,
                     const std::filesystem::path& file);

/// Writes the skin of the model in one pose with the point arrays `distance_mm` (smoothed, NaN where no scan point is
/// near), `standard_error_mm` and `area` (row of the field data `area_names`). @throws InputError  as above
void write_error_map(const calibration::ModelSkin& skin, const SkinError& error, const calibration::SkinAreas& areas,
                     const std::filesystem::path& file);

}  // namespace supine::diagnosis
