// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/diagnose.h"
#include "diagnosis/error_budget.h"
#include "diagnosis/force_map.h"

namespace supine::diagnosis {

/// What is examined. Everything it points to must outlive the findings.
struct Subject {
  calibration::MeasuredScene fitted;                ///< poses that the model was fitted to
  calibration::MeasuredScene whole;                 ///< those, then every other measured pose
  simulation::Model model;                          ///< calibrated
  std::vector<double> noise_mm;                     ///< per fitted measurement
  const simulation::ChainSolution* near = nullptr;  ///< solution of the model, where known
};

struct ExamineOptions {
  int refits = 6;            ///< candidates that are added and fitted again, at most; 0 = linear predictions only
  bool other_meshes = true;  ///< measure the numerical error; false: take it from the residual itself
  /// Correct poses that are not fitted for the mesh also where nothing stands out: a third of the work then, for one
  /// figure. Where something does they always are.
  bool correct_quiet_poses = false;
  unsigned seed = 1;
  Tolerances tolerances = {};
  VerdictRules rules = {};
  std::function<void(const std::string&)> progress = {};  ///< may be empty
};

/// All that one examination finds.
struct Findings {
  simulation::Model model;        ///< the base model, its free numbers at the least of F
  std::vector<std::string> free;  ///< their names
  WeightedFit base;
  Metric metric;  ///< points into this object
  Whitening whitening;
  ErrorSources sources;
  Tolerances tolerances;                    ///< of the sources
  OtherPoses others;                        ///< the base model in poses that it was not fitted to
  std::optional<NumericalError> numerical;  ///< none where no other mesh was tried, or none gave an answer
  std::string numerical_failure;            ///< why not
  std::vector<Candidate> candidates;
  std::vector<std::string> unseen;  ///< effects that move no fitted point, here or anywhere
  ScoreTable table;
  std::vector<Refit> refits;    ///< best first
  std::vector<LackOfFit> left;  ///< per refit
  BaseFigures figures;
  ErrorBudget budget;
  Diagnosis diagnosis;
  std::optional<ForceMap> forces;  ///< that would explain what is left; only when unexplained

  Findings() = default;
  Findings(const Findings&) = delete;
  Findings& operator=(const Findings&) = delete;
};

/// The whole examination: numerical error on other meshes, a fit of the base model under all errors, scores of the
/// catalogue, refits of those that could be it, the verdict. Reads nothing but @p subject.
/// @throws NumericalFailure  no equilibrium of the model as given
std::unique_ptr<Findings> examine(const Subject& subject, const ExamineOptions& options);

/// What refits of the findings' candidates start from. Points into both.
RefitProblem refit_problem(const Subject& subject, const Findings& found,
                           const std::function<void(const std::string&)>& progress);

/// Effects worth a refit: of those whose T − 2q is within reach of the best, the @p count with the largest T − 2q
/// without the tolerance for the effect itself.
/// @param poses  that are fitted
std::vector<std::string> worth_refitting(const ScoreTable& table, const Tolerances& tolerances, std::size_t poses,
                                         std::size_t count);

}  // namespace supine::diagnosis
