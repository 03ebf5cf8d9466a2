// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/uncertainty.h"
#include "pipeline/case/measured_case.h"

namespace supine::pipeline {

/// A calibrated model with what it is worth, whatever method found it.
struct CalibrationResult {
  std::string method;   ///< least-squares, joint or cmaes
  bool object = false;  ///< the body is not of tissue
  calibration::Fit fit;
  calibration::Uncertainty uncertainty;
  std::vector<calibration::Interval> intervals;
  bool used_priors = true;
  std::vector<std::optional<Likelihood>> likelihoods;  ///< per coordinate, its own prior taken out
  std::string interval_kind;                           ///< profile, linear or posterior
  std::vector<double> noise_mm;
  calibration::DistanceFigures in_sample;  ///< points that were fitted
  /// Of the joint method: the same model without what was found of scans' places, gravity and the rest.
  std::optional<calibration::DistanceFigures> as_given;
  calibration::DistanceFigures held_out_blocks;  ///< the same points, each predicted from a fit without its block
  struct PoseError {
    std::string pose;
    double mae_study_mm;
    calibration::DistanceFigures figures;
  };
  std::vector<PoseError> held_out_poses;
  /// Of the joint method: a number that is never known, where it came out and what is left open of it.
  struct Nuisance {
    std::string name;
    double value, sd;
  };
  std::vector<Nuisance> nuisances;
  /// Of the other methods: where the columns of Uncertainty::never_known come from (diagnosis::NeverKnown::sources).
  std::vector<std::string> never_known;
  std::map<std::string, calibration::Profile> profiles;  ///< of intervals that are profiles, by parameter
};

/// Keys as in docs/calibration.md.
nlohmann::ordered_json calibration_figures(const MeasuredCase& measured, const calibration::FreeParameters& parameters,
                                           const CalibrationResult& result);

/// What a person should know of parameters at their bounds, products and pairs, one sentence each.
std::vector<std::string> calibration_remarks(const calibration::FreeParameters& parameters,
                                             const CalibrationResult& result);

void say_calibration(const Run& run, const calibration::FreeParameters& parameters, const CalibrationResult& result);

}  // namespace supine::pipeline
