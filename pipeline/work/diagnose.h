// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "diagnosis/examine.h"
#include "pipeline/case/case_priors.h"
#include "pipeline/case/measured_case.h"
#include "pipeline/results/diagnosis_report.h"

namespace supine::pipeline {

/// What is asked for beside case and model; as the options of supine-diagnose.
struct DiagnoseOptions {
  int refits = 5;            ///< sets of effects that are followed through the chain, at most
  bool other_meshes = true;  ///< measure the error of the mesh; false: it is taken to be exact
  unsigned seed = 1;
  KnownOptions known = {};
  double unlisted = 0.1;                   ///< Priors::unlisted
  std::vector<double> prior_of_sets = {};  ///< of nothing, one, two and three effects; empty = the defaults
  /// Of discrepancy, nuisances, patchiness and landmarks: what the examination does as if there were none.
  std::vector<std::string> without = {};

  /// @throws InputError  naming the option, its value and the bound
  void check() const;
};

/// A case with a calibrated model, and where priors stand.
struct CaseToDiagnose {
  std::unique_ptr<MeasuredCase> measured;
  simulation::Model given;  ///< the calibrated model, priors of what is free in the case's own model as there
  std::vector<double> noise_mm;
  diagnosis::Patchiness patchiness;

  diagnosis::Subject subject() const { return subject_of(*measured, given, noise_mm); }
};

/// Measures the case with the calibrated model, or where that carries the body no more, as a fit to a scan out of place
/// may end, with the case's own.
/// @param inputs   with the calibrated model
/// @param without  DiagnoseOptions::without; landmarks named there are not read
/// @throws InputError, NumericalFailure  as measure_case()
CaseToDiagnose measure_to_diagnose(Run& run, CaseInputs inputs, const std::vector<std::string>& without = {});

/// What the examination takes; its progress goes to @p live.
diagnosis::ExamineOptions examine_options(const CaseToDiagnose& subject, const DiagnoseOptions& options,
                                          LiveProgress& live);

/// What supine-diagnose does between reading and writing.
/// @throws InputError  what fits best with an error that no measurement has: a wrong file
/// @throws NumericalFailure  as diagnosis::examine()
DiagnosisResult diagnose(Run& run, const CaseToDiagnose& subject, const diagnosis::ExamineOptions& options,
                         LiveProgress& live);

}  // namespace supine::pipeline
