// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calibration/least_squares.h"

namespace supine::diagnosis {

/// What the mesh does to the distances of this patient: the same model solved on other meshes of the same body.
struct NumericalError {
  Eigen::VectorXd finer_mm;    ///< #R, distance with finer elements, less that on the given mesh
  double finer_doubt = 1;      ///< how uncertain finer_mm is, as a share of it
  Eigen::VectorXd coarser_mm;  ///< #R, the same for another surface of four fifths of the triangles
  double spread_mm = 0;        ///< rms of finer_doubt × finer_mm and coarser_mm: what is left when finer_mm was added
  Eigen::VectorXd share;       ///< #R, of the spread at each point: what the places around it show; mean square 1
  double length_mm = 0;        ///< over which it is alike
  /// Why a mesh gave no answer, or empty; where it gave none its column is zero and the other counts twice in
  /// the spread.
  std::string finer_failure, coarser_failure;
  /// Of linear elements: what finer_mm comes from, to start the next one from.
  simulation::Model model;
  simulation::ChainSolution given, finer;
};

/// Two other meshes, one solve each, side by side. Finer than linear tetrahedra are quadratic ones of the same shapes
/// (nearly all of the error is in the order: at the true moduli of a computed breast they leave noise and a third of
/// the change, docs/diagnosis.md), finer than quadratic ones a mesh refined at the skin's end; coarser_mesh
/// (other_mesh.h).
/// @param near  of the same scene and a similar model, to start from; or nullptr
/// @throws NumericalFailure  neither mesh gave an answer
NumericalError measure_numerical_error(const calibration::MeasuredScene& scene, const simulation::Model& model,
                                       const calibration::Fit& fit, const NumericalError* near = nullptr);

/// Length l of exp(−r/l) that fits the correlation of neighbours in @p field, a change over the residuals' points with
/// or without a mean; between 5 and 60 mm.
double correlation_length_mm(const calibration::Residuals& residuals, const Eigen::VectorXd& field);

}  // namespace supine::diagnosis
