// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "calibration/least_squares.h"
#include "meshing/tet_mesh.h"

namespace supine::diagnosis {

/// What the mesh does to the distances of this patient: the same model solved on other meshes of the same body.
struct NumericalError {
  Eigen::VectorXd finer_mm;    ///< #R, distance with finer elements, less that on the given mesh
  double finer_doubt = 1;      ///< how uncertain finer_mm is, as a share of it
  Eigen::VectorXd coarser_mm;  ///< #R, what another surface of the body changes
  /// Away from creases (creases.h), rms of finer_doubt × finer_mm and coarser_mm: what is left when finer_mm was added.
  double spread_mm = 0;
  Eigen::VectorXd share;  ///< #R, of the spread at each point: what the places around it show; mean square 1 there
  double length_mm = 0;   ///< over which it is alike
  /// Why a mesh gave no answer, or empty. Its column is zero then, and the spread not less than largest_share_of_way
  /// of the way to the first pose.
  std::string finer_failure, coarser_failure;
  /// Of linear elements, to start the next one from: both orders on the given mesh, or on `coarse` where there is one.
  std::shared_ptr<const meshing::TetMesh> coarse;
  simulation::ChainSolution linear, quadratic;
  /// Of quadratic elements, for the same: the other meshes and the model on them.
  struct OnOther {
    std::shared_ptr<const meshing::TetMesh> mesh;
    simulation::ChainSolution solution;
    simulation::ChainSolution given;  ///< that on the given mesh, carried to the nodes of this one
  };
  OnOther on_finer, on_coarser;
};

/// Spread where it could not be measured, as a share of the way that the body has moved. Correction and spread together
/// were 2.3 to 7.7 % of it, 4.5 % in the median, on sixteen computed breasts (docs/diagnosis.md).
inline constexpr double largest_share_of_way = 0.08;

/// Way from the imaged pose to the first other one, rms over the nodes.
double way_mm(const simulation::ChainSolution& solution);

/// Of linear elements: nearly all of their error is in the order, and falls as the edge. Quadratic ones of the same
/// tetrahedra show it where Newton's method comes to them from the linear solution without a detour (elsewhere it may
/// end in another equilibrium, folds of thin skin); beside them a coarser surface (other_mesh.h).
/// Else a mesh of a third of the cells is solved with linear (l) and quadratic (q) elements, which stay together and
/// take a tenth of the time; with r the ratio of the edges, given over coarse, from the numbers of cells,
///   finer = r (q − l),   coarser = (l − given + (1 − r)(q − l)) / max(1, r⁻² − 1),
/// the latter what is left of the change between the two linear ones: the surface, of second order.
/// Of quadratic ones: a mesh refined at the skin's end, and one on a coarser surface.
/// @param near       of the same scene and a similar model, to start from; or nullptr
/// @param most_work  of each solve on another mesh of quadratic elements (SolveOptions::most_work)
NumericalError measure_numerical_error(const calibration::MeasuredScene& scene, const simulation::Model& model,
                                       const calibration::Fit& fit, const NumericalError* near = nullptr,
                                       int most_work = simulation::SolveOptions().most_work);

/// Length l of exp(−r/l) that fits the correlation of neighbours in @p field, a change over the residuals' points with
/// or without a mean; between 5 and 60 mm.
double correlation_length_mm(const calibration::Residuals& residuals, const Eigen::VectorXd& field);

}  // namespace supine::diagnosis
