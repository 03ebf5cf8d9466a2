// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/diagnose.h"
#include "diagnosis/error_budget.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/fit_errors.h"
#include "diagnosis/evidence/other_priors.h"
#include "diagnosis/evidence/set_refit.h"
#include "diagnosis/force_map.h"
#include "diagnosis/score_test.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// What is examined. Everything it points to must outlive the findings.
struct Subject {
  calibration::MeasuredScene scene;                 ///< every measured pose
  simulation::Model given;                          ///< where priors stand
  simulation::Model start;                          ///< the same with the numbers to begin with
  std::vector<double> noise_mm;                     ///< per measurement
  const simulation::ChainSolution* near = nullptr;  ///< solution of `start`, where known
};

struct ExamineOptions {
  int refits = 5;            ///< sets of effects that are followed through the chain, at most; 0 = straight lines only
  bool other_meshes = true;  ///< measure the error of the mesh; false: it is taken to have none
  unsigned seed = 1;
  Priors priors = {};
  std::function<void(const std::string&)> progress = {};  ///< may be empty
};

/// Where a scan lies, beyond where it was said to lie.
struct ScanPlace {
  std::string pose;
  Eigen::Vector3d shift_mm, turn_deg;
  Eigen::Matrix<double, 6, 1> sd;  ///< mm, then degrees
};

/// All that one examination finds.
struct Findings {
  BaseFit base;                            ///< a model that lacks nothing
  double rms_mm = 0, held_out_rms_mm = 0;  ///< of it
  std::vector<Candidate> candidates;
  std::vector<std::string> unseen;     ///< effects that move no fitted point, here or anywhere
  std::optional<FitErrors> errors;     ///< of the base model, nuisances and the likeliest discrepancy among them
  ScoreTable table;                    ///< information: what each effect's score says by itself
  std::vector<Hypothesis> hypotheses;  ///< most probable first
  /// Errors measured anew beside effects that are sure, for all that holds them (follow.h).
  struct Beside {
    std::vector<int> effects;  ///< rows of the candidates, ascending
    std::unique_ptr<BaseFit> ground;
    int surest = -1;           ///< of them, that the one before does not hold
    double ln_odds = 0;        ///< that a set holds them, as they were
    double left_out_gain = 0;  ///< of the surest, as it was
  };
  std::vector<Beside> beside;               ///< each holds those before it
  std::vector<Beside> dropped;              ///< that held an effect which does nothing
  std::vector<Refit> refits;                ///< of some of them, the likelier first
  std::vector<Inclusion> included;          ///< most probable first
  Unlisted unlisted;                        ///< causes that no effect lists, as rivals
  Unexplained unexplained;                  ///< over all hypotheses
  std::vector<Unexplained> unexplained_by;  ///< of the first hypotheses_told
  Unexplained left_by_base;                 ///< where nothing is added
  std::vector<ScanPlace> places;
  ErrorBudget budget;
  Diagnosis diagnosis;
  std::vector<OtherPrior> under_other_priors;  ///< the diagnosis, if something else had been believed before
  Priors priors;
  std::optional<ForceMap> forces;  ///< that would explain what is left; only when unexplained

  static constexpr std::size_t hypotheses_told = 6;

  Findings() = default;
  Findings(const Findings&) = delete;
  Findings& operator=(const Findings&) = delete;

  const Inclusion& included_of(const std::string& effect) const;  ///< @pre  a candidate
  /// The most probable, and always "nothing", with what each leaves unexplained.
  std::vector<std::pair<const Hypothesis*, Unexplained>> told() const;
  std::vector<std::string> effects() const;                              ///< of the candidates
  std::vector<std::string> errors_beside() const;                        ///< that errors were last measured beside
  const Refit* refit_of(const std::vector<std::string>& effects) const;  ///< of that set; nullptr where there is none
  /// The refit of the likeliest set that holds the effect and was followed; nullptr where there is none.
  const Refit* likeliest_with(const std::string& effect) const;
};

/// The whole examination: a fit of the base model with all that is never known, the catalogue weighed along straight
/// lines, the likeliest sets followed through the chain, probabilities, the verdict. Reads nothing but @p subject.
/// @throws NumericalFailure  no equilibrium of the model as given
std::unique_ptr<Findings> examine(const Subject& subject, const ExamineOptions& options);

}  // namespace supine::diagnosis
