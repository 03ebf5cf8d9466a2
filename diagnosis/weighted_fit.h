// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "calibration/least_squares.h"
#include "diagnosis/whitening.h"

namespace supine::diagnosis {

/// How a model is judged here: the distances of a fixed set of points, weighed by all that is known of their errors.
struct Metric {
  const Whitening* whitening;
  Eigen::VectorXd mean_mm;       ///< #R, added to the distances: what the mesh takes away
  calibration::PointMask mask;   ///< the points
  std::vector<double> noise_mm;  ///< per measurement, for Residuals::sigma_mm
};

/// A model at (or on its way to) the least of F(u) = ‖L⁻¹ (d(u) + mean)‖² + Σ ((u_j − m_j)/s_j)².
struct WeightedFit {
  calibration::Fit solution;  ///< u, prediction, mask, residuals, linearisation
  double objective = 0;       ///< F; at the truth its data part is χ² distributed
  double data = 0;            ///< its first part
  bool converged = false;
  int evaluations = 0;
};

struct DescentOptions {
  int max_iterations = 10;
  double settled = 0.2;  ///< stop when the next step promises to lower F by less
};

/// Of F: where creases of the skin make distances rough, a step that promises less than this and does not keep it is
/// not shortened. What it promises counts in the evidence all the same, and is less than one of its logarithm.
inline constexpr double worth_shortening = 2;

/// Of all solves whose distances are compared with a scan: hundredths of a micrometre are nothing beside its noise.
simulation::SolveOptions accurate_enough();
/// Of solves far away whose distances are taken as they are, to thousandths of a millimetre.
simulation::SolveOptions accurate_enough_far_away();

/// F and its slopes at given coordinates. @throws NumericalFailure  no equilibrium
WeightedFit weigh(calibration::Evaluator& evaluator, const calibration::FreeParameters& parameters,
                  const Metric& metric, const Eigen::VectorXd& u, const simulation::ChainSolution* near);

/// Levenberg-Marquardt with exact sensitivities inside the parameters' ranges: coordinates at an end that pull further
/// out are held. A step without equilibrium is shortened. Points are those of the metric throughout.
void descend(calibration::Evaluator& evaluator, const calibration::FreeParameters& parameters, const Metric& metric,
             const DescentOptions& options, WeightedFit& fit);

}  // namespace supine::diagnosis
