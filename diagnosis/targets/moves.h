// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "calibration/free_parameters.h"
#include "diagnosis/evidence/nuisances.h"
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
  simulation::Chain& chain;
  const simulation::Sensitivities& sensitivities;
  const simulation::Model& model;
};

/// @param u       coordinates of the free parameters in the model
/// @param forces  on the nodes, in the second pose alone
PointMoves moves_of(const PoseAt& at, const simulation::Embedding& points, const calibration::FreeParameters& free,
                    const Eigen::VectorXd& u, const std::vector<Nuisance>& nuisances, const Patchiness& patchiness,
                    const std::vector<Eigen::VectorXd>& forces);

}  // namespace supine::diagnosis
