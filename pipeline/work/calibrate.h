// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calibration/run_journal.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/results/calibration_report.h"

namespace supine::pipeline {

/// What is asked for beside case and model; as the options of supine-calibrate.
struct CalibrateOptions {
  std::string method = {};             ///< least-squares, joint or cmaes; empty: choose_method() says which
  std::string intervals = "linear";    ///< linear or profile
  std::optional<double> until_mae_mm;  ///< the study's MAE to reach; cmaes stops there
  unsigned seed = 1;
  int starts = 1;
  double robust_mm = 5;
  int population = 0, max_evaluations = 300;                        ///< cmaes
  std::vector<std::string> profile_of = {};                         ///< profiles of these alone; empty = all
  std::map<std::string, calibration::Profile> known_profiles = {};  ///< taken as they are, by parameter
  bool use_priors = true;
  bool scan_offset = false;                               ///< the scan's place is fitted as well
  bool map = false;                                       ///< a map of the error follows
  std::vector<const calibration::OwnResidual*> own = {};  ///< least-squares: what counts beside the scans

  /// Where no method is named: joint, or least-squares where something is asked for that joint does not know.
  void choose_method();

  /// @throws InputError  naming the option: a method or kind of interval there is not, a number out of its range, what
  ///   does not go with the method   @pre  a method
  void check() const;

 private:
  struct Use;
  std::vector<Use> uses() const;
};

/// The model's free numbers, with what a population says of them, and where the search begins.
/// @throws InputError  no free number
calibration::FreeParameters parameters_to_fit(Run& run, const MeasuredCase& measured, const CalibrateOptions& options);

/// What supine-calibrate does between reading and writing: the fit, what it is worth, what was held out.
/// @param parameters  of parameters_to_fit(); with scan_offset its base model has an effect more than the case's
/// @param journal     of the chain runs of cmaes
/// @throws NumericalFailure  no equilibrium at any start
CalibrationResult calibrate(Run& run, const MeasuredCase& measured, const calibration::FreeParameters& parameters,
                            const CalibrateOptions& options, calibration::RunJournal& journal);

/// The case's model with the fitted numbers in their places; everything else, comments too, stays.
ModelText fitted_model(const MeasuredCase& measured, const calibration::FreeParameters& parameters,
                       const CalibrationResult& result);

/// Whether the fit converged and reached what was asked for. Warns otherwise.
Outcome judge(Run& run, const CalibrateOptions& options, const CalibrationResult& result);

}  // namespace supine::pipeline
