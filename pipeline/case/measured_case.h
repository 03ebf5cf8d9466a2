// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/evaluator.h"
#include "pipeline/case/case_inputs.h"

namespace supine::pipeline {

/// A case with its mesh, a model and every measured surface, ready for distances: what calibration, sensitivity and
/// diagnosis start from.
struct MeasuredCase : CaseInputs {
  /// breast.young_modulus_kpa to begin with, where the given one has no equilibrium.
  std::optional<double> carrying_modulus_kpa;
  std::vector<calibration::Measurement> fitted;    ///< in the order of [calibration] poses
  std::vector<calibration::Measurement> held_out;  ///< every other measured pose
  /// Of the poses that have some, by name; without sigma_mm in either file 1.5 mm.
  std::map<std::string, calibration::MeasuredLandmarks> landmarks;
  simulation::ChainSolution start;  ///< of begin_with(model); poses: fitted, then held out

  /// A model with numbers that a search can begin with: the same, or with the modulus raised to one that carries the
  /// body.
  simulation::Model begin_with(simulation::Model wanted) const;

  /// The surfaces that are fitted.
  calibration::MeasuredScene fitted_scene() const;
  /// What is fitted and its landmarks; all that is measured.
  /// @throws InputError  landmarks that lie elsewhere than the model as given can have them (check_landmarks())
  calibration::MeasuredScene marked_scene() const;
  calibration::MeasuredScene whole_scene() const;
  /// @param what  goes by the MAE model to scan: "--method cmaes"
  /// @throws InputError  every fitted scan is a contour, which covers no skin
  void check_covers_skin(const std::string& what) const;
  /// Of each measurement of a scene: as the case says, or estimated from the distances to the given model.
  /// @param evaluator  of fitted_scene() or whole_scene()
  std::vector<double> noise_mm(calibration::Evaluator& evaluator) const;
};

/// Reads the measurements, and solves the model as given once, because only a predicted skin tells which side of a scan
/// is outside and whether it lies at the body. Where there is no equilibrium under a free breast.young_modulus_kpa,
/// what begins here begins with one under which there is, with a warning; priors stay.
/// @throws InputError  a fitted pose without a surface; no interface; side = "both" without two breasts; a scan that is
///   not at the body; a landmark without a place in prone; effects that can change nothing
/// @throws NumericalFailure  no equilibrium with the model as given, and its modulus is fixed or nothing in its range
///   carries the body
std::unique_ptr<MeasuredCase> measure_case(Run& run, CaseInputs inputs);

/// The same of files: read_case_inputs().
std::unique_ptr<MeasuredCase> read_measured_case(Run& run, const std::filesystem::path& folder,
                                                 const std::filesystem::path& mesh_file,
                                                 const std::filesystem::path& model_file);

/// Progress of long work: one line that overwrites itself on a terminal, a line of its own where standard error is a
/// file or a pipe. Threads may call it at the same time.
class LiveProgress {
 public:
  /// @param pause  least time between two lines in a file or a pipe; none where each line begins work of its own
  explicit LiveProgress(const Run& run, std::chrono::seconds pause = std::chrono::seconds(5));
  ~LiveProgress();
  void show(const std::string& line);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace supine::pipeline
