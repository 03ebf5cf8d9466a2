// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "calibration/error_model.h"
#include "calibration/evaluator.h"
#include "calibration/residuals.h"

namespace supine::diagnosis {

/// Covariance of what no effect explains, over clusters of points: a deformation that unknown forces could make. Its
/// mean square is 1 mm² over the clusters; times s² it is that of an error of s mm.
///
/// Forces act in the measured poses alone, on 60 centres of the skin and 60 of the inner surface, a Gaussian bump each
/// in three directions, their strengths correlated over 25 mm; half of their variance is common to all poses and fixed
/// to the body, half each pose's own. One solve of the pose's tangent each. A tenth of the variance is no force but a
/// field correlated over 25 mm (Kennedy and O'Hagan 2001, with a kernel that mechanics shapes).
/// @param sensitivities  of the prediction's solution on @p mesh
struct Discrepancy {
  std::vector<Eigen::VectorXd> forces;  ///< on the nodes, 3 per node, mN: independent, of one standard deviation each
  Eigen::MatrixXd columns;              ///< what each does to the distances over the clusters, in its pose alone, mm
  Eigen::MatrixXd kernel;               ///< covariance over the clusters
};
/// Share of a force's variance that all poses have in common; of what is no force, and its length.
inline constexpr double common_to_poses = 0.5, share_beyond_forces = 0.1, beyond_forces_length_mm = 25;

/// Forces on the nodes of the body in its undeformed shape @p X, not scaled.
std::vector<Eigen::VectorXd> discrepancy_forces(const meshing::TetMesh& mesh, const Points& X);

Discrepancy discrepancy_of(const meshing::TetMesh& mesh, const simulation::Sensitivities& sensitivities,
                           const calibration::Prediction& prediction, const calibration::Residuals& residuals,
                           const calibration::Clusters& clusters);

}  // namespace supine::diagnosis
