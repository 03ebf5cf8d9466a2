// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "calibration/evaluator_pool.h"

namespace supine::calibration {

/// The error over two parameters, all others held: shows the ridge on which they trade.
struct ErrorMap {
  std::string x_name, y_name;
  std::vector<double> x, y;        ///< values of the parameters, ascending, evenly spaced in their coordinates
  std::vector<RunResult> results;  ///< x fastest
};

/// @param u      centre, coordinates of FreeParameters
/// @param axes   the two parameters
/// @param count  values per parameter, >= 2
/// @param reach  in coordinates (1 = a factor of e for a modulus); cut at the range
ErrorMap map_error(EvaluatorPool& pool, const FreeParameters& parameters, const Eigen::VectorXd& u,
                   std::pair<Eigen::Index, Eigen::Index> axes, int count, double reach, RunJournal& journal,
                   const std::function<void(const RunResult&)>& done = {});

/// Columns: both parameters, mae_study_mm, mae_mm, rms_mm, failed. @throws InputError  not writable
void write_map_csv(const ErrorMap& map, const std::filesystem::path& file);

/// Image of count × count points over the logarithms of the values (base 10) with the point arrays mae_study_mm and
/// rms_mm, NaN where there was no equilibrium. @throws InputError  not writable
void write_map_vti(const ErrorMap& map, const std::filesystem::path& file);

}  // namespace supine::calibration
