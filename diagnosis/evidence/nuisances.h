// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "calibration/evaluator.h"
#include "calibration/residuals.h"
#include "diagnosis/evidence/priors.h"

namespace supine::diagnosis {

/// A number that is never known: normal around what the model says, and what it does to the distances.
struct Nuisance {
  std::string source;  ///< registration, gravity, chest_wall, springs, gland, …
  std::string pose;    ///< the pose it is of; empty: one for all
  /// Catalogue entry and row that carry it (Model::of_pose), or a number of the base model (then `effect` is empty).
  std::string effect, parameter;
  double sigma;              ///< in the parameter's unit; of a base number that of its logarithm
  Eigen::VectorXd shape_mm;  ///< #R, change of the distances by one sigma
  double value = 0;          ///< where the model has it, in sigma
  /// What its number does to the shapes where the distances' change was found, in all poses at once, and how much of
  /// the number one sigma is; none before find_shapes().
  std::shared_ptr<const simulation::ChainDerivative> motion{};
  double motion_per_sigma = 0;

  /// As in parameters.h: "misregistration.shift_x_mm".
  std::string setting() const { return (effect.empty() ? "" : effect + ".") + parameter; }
  /// "supine/misregistration.shift_x_mm"; of what is one for all poses "/gland_stiffness.log_ratio".
  std::string name() const { return pose + "/" + setting(); }
};

/// The imaged pose, then the measured ones.
std::vector<std::string> poses_of(const calibration::MeasuredScene& scene);

/// All of them, at their null, without shapes. What the model fits itself, or an effect of it says once for all poses,
/// is not there.
std::vector<Nuisance> nuisances_of(const simulation::Model& model, const std::vector<std::string>& poses,
                                   const Priors& priors);

/// The model with the nuisances at their values.
simulation::Model with_nuisances(simulation::Model model, const std::vector<Nuisance>& nuisances,
                                 const std::vector<std::string>& poses);

/// Moves the shapes of a solution by a first-order step of a nuisance, in sigma: in its pose, or all.
void move_along(const Nuisance& nuisance, double step, simulation::ChainSolution& solution);

/// Fills the shapes at a solved model, of distances and body.
void find_shapes(calibration::Evaluator& evaluator, const simulation::Sensitivities& sensitivities,
                 const simulation::Model& model, const calibration::Prediction& prediction,
                 const calibration::Residuals& residuals, std::vector<Nuisance>& nuisances);

}  // namespace supine::diagnosis
