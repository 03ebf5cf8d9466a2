// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/targets/conditioned.h"
#include "diagnosis/targets/moves.h"

namespace supine::diagnosis {

/// A scan that could be made of one more pose, as rows beside what was measured: columns of one row per scanned place,
/// mm along the normal.
struct FurtherScan {
  Eigen::MatrixXd directions;  ///< per direction of the joint moves, then of what is never known of this scan alone
  Eigen::MatrixXd patches;     ///< per shape of patchiness.h
  Eigen::MatrixXd forces;      ///< per force
  Eigen::MatrixXd errors;      ///< of scanner and mesh
  Eigen::MatrixXd kernel;      ///< of what no effect explains
};

/// @param at         the further pose, solved
/// @param nuisances  of the joint moves, in their order behind the free parameters
/// @param mesh_share of the way from the imaged pose that the mesh errs by, each axis
FurtherScan further_scan(PoseAt& at, const meshing::TetMesh& mesh, const calibration::FreeParameters& free,
                         const Eigen::VectorXd& u, const std::vector<Nuisance>& nuisances, const Priors& priors,
                         const std::vector<Eigen::VectorXd>& forces, double mesh_share);

/// The moves with that scan among what is measured. Its distances are not known: covariance_after() needs none.
/// @param data_forces    what forces do to what was measured, #n by #f
/// @param target_forces  to the targets, #t by #f
JointMoves with_further_scan(const JointMoves& joint, const FurtherScan& scan, const Eigen::MatrixXd& data_forces,
                             const Eigen::MatrixXd& target_forces);

}  // namespace supine::diagnosis
