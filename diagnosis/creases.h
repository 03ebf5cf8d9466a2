// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "calibration/evaluator.h"
#include "calibration/residuals.h"

namespace supine::diagnosis {

/// Stretch across the skin over the smaller one along it, (λ₁ λ₂²)⁻¹ of an incompressible body, from which a triangle
/// counts as creased. A flat free surface of a neo-Hookean solid folds at 2.4 by itself (Hong, Zhao and Suo 2009), and
/// a triangle says the mean over its area.
inline constexpr double creased_from = 2.0;

/// Whether each triangle is creased.
/// @param undeformed, deformed  #N by 3
Eigen::Array<bool, Eigen::Dynamic, 1> creased(const Triangles& triangles, const Points& undeformed,
                                              const Points& deformed);

/// What creases of the model's skin may do to distances: how a soft surface folds, and how its fold moves with a
/// modulus, is a matter of the mesh (docs/diagnosis.md).
struct CreaseError {
  Eigen::VectorXd sd_mm;    ///< #R; a third of the skin's edge over a crease and within an edge of one, else 0
  double length_mm = 1;     ///< over which it is alike: two edges
  Eigen::Index points = 0;  ///< how many it is of
};
CreaseError crease_error(const calibration::MeasuredScene& scene, const calibration::Prediction& prediction,
                         const calibration::Residuals& residuals);

}  // namespace supine::diagnosis
