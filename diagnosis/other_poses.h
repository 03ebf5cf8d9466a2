// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/error_sources.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// A model seen in poses that it was not fitted to, the mesh's error taken away as far as it is known.
struct OtherPoses {
  std::size_t unfitted = 0;                  ///< how many of the distances are of poses that are not fitted at all
  calibration::PointMask mask;               ///< their points, as the base model has them over its skin
  std::vector<Eigen::VectorXd> distance_mm;  ///< of those points; then of fitted poses left out
  std::vector<double> noise_mm;              ///< of the scan of each; only of the base model
  /// ‖L⁻¹ d‖² of the poses that are not fitted: Σ = L Lᵀ holds all that their distances may be at a base model that
  /// lacks nothing (error_sources.h), and what its parameters are uncertain by.
  double objective = 0;
  double misfit = 1;                             ///< objective per row: 1 is what errors alone leave
  std::shared_ptr<const Whitening> whitening;    ///< L⁻¹
  std::vector<simulation::PoseSolution> solved;  ///< of the poses that are not fitted
  Points X;                                      ///< undeformed nodes of these, mm
  std::string failure;  ///< why no pose that is not fitted judges although there are some; empty where they do

  /// Root mean square of each.
  std::vector<double> rms_mm() const;
  /// Root mean square of the difference of each; empty where the other has another number of poses.
  std::vector<double> change_mm(const OtherPoses& other) const;
};

/// Every pose that is not fitted, then each fitted one left out (left_out_pose.h), where several are. The former judge
/// only where each has an equilibrium and points over the skin. Where the model says that the fitted scan lies
/// elsewhere the former judge nothing, because another scan lies elsewhere in its own way.
/// @param whole   the fitted scene and, after its measurements, those that are not fitted
/// @param metric  of the fit
OtherPoses other_poses_of_base(const calibration::MeasuredScene& whole, const calibration::FreeParameters& parameters,
                               const WeightedFit& fit, const ErrorSources& sources, const Metric& metric,
                               const Tolerances& tolerances);

/// The same poses and points of a refit, starting from there. Nothing where one has no equilibrium.
OtherPoses other_poses_of_refit(const calibration::MeasuredScene& whole, const calibration::FreeParameters& parameters,
                                const WeightedFit& fit, const ErrorSources& sources, const OtherPoses& base);

}  // namespace supine::diagnosis
