// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "calibration/least_squares.h"
#include "diagnosis/stand_in.h"

namespace supine::diagnosis {

/// One parameter of a candidate.
struct CandidateParameter {
  std::string name;  ///< as in parameters.h
  std::string unit;
  double null, lower, upper;
  double typical;  ///< size that is usual: the catalogue's median, or its spread where no sign is likelier
  bool one_sided;
};

/// An effect that the model does not have, and what the measured distances would do if it had it.
struct Candidate {
  std::string effect;
  std::vector<CandidateParameter> parameters;
  Eigen::MatrixXd slope;     ///< ∂d/∂(parameter) at its null, #R by #parameters, mm per unit; through both solves
  Eigen::VectorXd secant{};  ///< change of the distances at the usual size, #R; empty where it was not solved
  bool no_secant = false;    ///< no equilibrium was found there
  double secant_to = 0;      ///< offset of its number from the null at which the secant was taken; 0: there is none
  std::shared_ptr<const simulation::ChainSolution> secant_at{};  ///< the chain there, where it was kept
  std::shared_ptr<const StandIn> stand_in{};                     ///< where straight lines promise too much of it
  /// What its parameters do to the shapes at their nulls, per unit; empty where that was not asked.
  std::vector<std::shared_ptr<const simulation::ChainDerivative>> motion{};
};

/// Moves the shapes of a solution by a first-order step of parameter @p k, in its unit, 5 mm at the most: where to look
/// for the chain with an effect, whose lines may lead far beyond it.
void move_along(const Candidate& candidate, std::size_t k, double step, simulation::ChainSolution& solution);

/// Every effect of the catalogue that the body can have and the model has not, with all its numbers but those of place
/// and shape (Parameter::shape), which change nothing at the null. Without slopes.
std::vector<Candidate> lacking_effects(const simulation::Model& model, const meshing::TetMesh& mesh,
                                       const meshing::Anatomy& anatomy);

/// Every effect of the catalogue that is not in the model and that the fitted points can feel. Parameters that change
/// nothing at the null are left out: place and shape (Parameter::shape), and what these points do not feel.
/// @param unseen  out: effects of the catalogue that move no fitted point, here or anywhere
std::vector<Candidate> find_candidates(calibration::Evaluator& evaluator, const simulation::Model& model,
                                       const calibration::Fit& fit, std::vector<std::string>& unseen);

}  // namespace supine::diagnosis
