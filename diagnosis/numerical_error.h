// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calibration/least_squares.h"

namespace supine::diagnosis {

/// What the mesh does to the distances of this patient: the same model solved on other meshes of the same body.
struct NumericalError {
  Eigen::VectorXd finer_mm;    ///< #R, distance on a mesh refined where the error is made, less that on the given mesh
  Eigen::VectorXd coarser_mm;  ///< #R, the same for another surface of four fifths of the triangles
  double spread_mm = 0;        ///< rms of both together: what is left when finer_mm has been added
  double length_mm = 0;        ///< over which it is alike
  std::vector<std::string> failed;  ///< why a mesh gave no answer; its column is zero and the other counts twice
};

/// Two other meshes (other_mesh.h), one solve each, side by side.
/// @throws NumericalFailure  neither mesh gave an answer
NumericalError measure_numerical_error(const calibration::Scene& scene, const simulation::Model& model,
                                       const calibration::Fit& fit);

/// Length l of exp(−r/l) that fits the correlation of neighbours in @p field, a change over the residuals' points with
/// or without a mean; between 5 and 60 mm.
double correlation_length_mm(const calibration::Residuals& residuals, const Eigen::VectorXd& field);

}  // namespace supine::diagnosis
