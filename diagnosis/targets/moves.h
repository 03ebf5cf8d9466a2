// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "calibration/free_parameters.h"
#include "diagnosis/evidence/nuisances.h"
#include "meshing/anatomy.h"
#include "simulation/embedding.h"
#include "simulation/solve/sensitivities.h"

namespace supine::diagnosis {

/// What moves points of the body in one pose: columns of 3 rows per point, mm.
struct PointMoves {
  Eigen::MatrixXd parameters;  ///< per coordinate of the free parameters
  Eigen::MatrixXd nuisances;   ///< per sigma of each
  Eigen::MatrixXd patches;     ///< per standard deviation of each shape of patchiness.h
  Eigen::MatrixXd forces;      ///< per force
};

/// A solved chain of two poses, the imaged one and the one asked for, at a model.
struct PoseAt {
  /// @param near  of the imaged pose and others, to start from, or nullptr
  /// @throws NumericalFailure  no equilibrium
  PoseAt(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const simulation::PoseLoad& imaged,
         const simulation::PoseLoad& pose, const simulation::Model& model_, const simulation::ChainSolution* near);
  simulation::Model model;
  simulation::Chain chain;
  simulation::ChainSolution solution;
  simulation::Sensitivities sensitivities;
  const Points& x() const { return solution.poses[0].x; }
  double way_mm() const;  ///< from the imaged pose, rms over the nodes
};

/// @param u       coordinates of the free parameters in the model
/// @param forces  on the nodes, in the second pose alone
PointMoves moves_of(const PoseAt& at, const simulation::Embedding& points, const calibration::FreeParameters& free,
                    const Eigen::VectorXd& u, const std::vector<Nuisance>& nuisances, const Patchiness& patchiness,
                    const std::vector<Eigen::VectorXd>& forces);

}  // namespace supine::diagnosis
