// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "calibration/monte_carlo.h"
#include "calibration/run_journal.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/results/sensitivity_table.h"

namespace supine::pipeline {

/// Draws below which shares of the variance are not told: three classes of three.
inline constexpr int least_samples = 10;

/// @throws InputError  naming @p file and key: a free number without prior_sd
void check_laws(const calibration::FreeParameters& parameters, const std::filesystem::path& file);

/// Draws of the free numbers, as many as @p count. Warns of those that were refused.
/// @param law  prior or normal, as --law of supine-sensitivity
/// @throws InputError  no such law; as calibration::draw_parameters()
calibration::Draws draw(Run& run, const calibration::FreeParameters& parameters, const std::string& law, int count,
                        unsigned seed);

/// Runs the chain for the draws of a range. Says how far it is.
/// @pre  the range ends with the draws
/// @throws InputError  a scan that covers no area
SensitivityRows run_draws(Run& run, const MeasuredCase& measured, const calibration::FreeParameters& parameters,
                          const calibration::Draws& draws, const DrawRange& range, calibration::RunJournal& journal);

/// Keys of sensitivity.json, as in docs/supine-sensitivity.md.
/// Shares of the variance are null where fewer than least_samples had an equilibrium.
/// @param rows  every draw
/// @throws NumericalFailure  fewer than two draws had an equilibrium
nlohmann::ordered_json sensitivity_figures(const calibration::FreeParameters& parameters, const std::string& law,
                                           const calibration::Draws& draws, const SensitivityRows& rows);

}  // namespace supine::pipeline
