// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/discrepancy.h"
#include "diagnosis/targets/conditioned.h"
#include "diagnosis/targets/missing_effects.h"
#include "diagnosis/targets/moves.h"
#include "diagnosis/targets/places.h"

namespace supine::diagnosis {

// Of a mesh whose error was not measured in the pose: 4.5 % of the way in the median of sixteen computed breasts
// (docs/diagnosis.md), spread over three axes.
double mesh_share_of_way();

/// The known nuisances, and behind them those of a pose that no measured pose has.
std::vector<Nuisance> with_those_of(const simulation::Model& model, std::vector<Nuisance> known,
                                    const std::string& imaged, const std::string& pose, const Priors& priors);

/// What of joint moves is of the distances, as a base fit has them. θ are its parameters, nuisances, then numbers of
/// effects that it may lack.
struct MeasuredPart {
  JointMoves joint;  ///< without what is of targets
  Discrepancy discrepancy;
};
/// @param nuisances  of the base fit, then further ones, which move no measured distance
MeasuredPart measured_part(calibration::Evaluator& evaluator, const BaseFit& base, const MissingEffects& missing,
                           const Priors& priors, const std::vector<Nuisance>& nuisances);

/// θ, sizes and sets without any measurement.
JointMoves believed_part(const calibration::FreeParameters& free, const std::vector<Nuisance>& nuisances,
                         const BelievedEffects& believed, const Priors& priors, double way_mm);

/// Fills what is of targets but their errors and what unknown forces do.
void fill_targets(const PointMoves& moves, const Eigen::MatrixXd& effects, JointMoves& joint);

/// Covariance of targets through forces that no effect stands for, of a size of 1 mm.
/// @param forces  what each moves the targets by, #t by #f
Eigen::MatrixXd target_kernel(const Eigen::MatrixXd& forces, const Points& places);

/// Fills what forces that no effect stands for make of distances and targets together, of a size of 1 mm.
/// @param forces  what each moves the targets by, #t by #f
/// @param pose    of the targets, among the measured ones; -1: none of them
void fill_kernels(const BaseFit& base, const Discrepancy& discrepancy, const Eigen::MatrixXd& forces,
                  const Points& places, int pose, JointMoves& joint);

/// Errors of the mesh: alike for places close to each other, #t by #t.
Eigen::MatrixXd mesh_errors(const Points& places, double sd_mm, double length_mm);

/// Rows of the clusters that are landmarks of one pose.
std::vector<int> landmark_rows(const calibration::Clusters& clusters, int pose);

/// Scales what forces move to a mean square of 1 mm² along the normal of the skin, as over the clusters of a scan.
void scale_forces(const PoseAt& at, const meshing::TetMesh& mesh, const std::vector<Eigen::VectorXd>& forces,
                  Eigen::MatrixXd& moves);

}  // namespace supine::diagnosis
