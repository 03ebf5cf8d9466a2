// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "calibration/free_parameters.h"
#include "calibration/run_journal.h"

namespace supine::pipeline {

/// A stretch of draws, first ≤ draw < end, counted from zero.
struct DrawRange {
  std::size_t first = 0, end = 0;
  std::size_t count() const { return end - first; }
};

/// "250:500". @throws InputError  not two whole numbers, the first below the second
DrawRange parse_draw_range(const std::string& text);

/// Draws and what they gave, in order. In a file: a row `sample,PARAMETERS…,mae_study_mm,mae_mm,rms_mm,failed` each,
/// samples counted from one, numbers with all their digits, nothing for the errors of a draw without equilibrium.
struct SensitivityRows {
  DrawRange range;
  std::vector<Eigen::VectorXd> values;          ///< of the parameters, in their units
  std::vector<calibration::RunResult> results;  ///< one per row of values
};

/// The draws that had an equilibrium: parameters (#E by #P, in their units) and mae_study_mm.
struct SolvedDraws {
  Eigen::MatrixXd values;
  std::vector<double> mae_study_mm;
};
SolvedDraws solved_draws(const SensitivityRows& rows, Eigen::Index parameters);

/// @throws InputError  the stream failed
void write_sensitivity(const SensitivityRows& rows, const std::vector<std::string>& parameters, std::ostream& stream);

/// Reads what write_sensitivity wrote of the same parameters.
/// @throws InputError  naming file and line: other parameters, a cell that is no number, samples out of order
SensitivityRows read_sensitivity(const std::filesystem::path& file, const std::vector<std::string>& parameters);

/// The rows of every part in one, in the order of the draws.
/// @param parts  with the file each came from
/// @param drawn  what the parameters must have been, one vector per draw: parts of another seed or law are refused
/// @throws InputError  a draw in no part or in two; a value that is not the one drawn
SensitivityRows merge_sensitivity(std::vector<std::pair<std::filesystem::path, SensitivityRows>> parts,
                                  const std::vector<Eigen::VectorXd>& drawn);

}  // namespace supine::pipeline
