// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/evaluator.h"

namespace supine::calibration {

/// Which scan points take part, per measurement.
using PointMask = std::vector<Eigen::Array<bool, Eigen::Dynamic, 1>>;

/// The scan points that lie over the model's skin, not beyond its border.
PointMask points_over_skin(const Prediction& prediction);

/// The measurement as one vector: the signed distances of the scan points that take part, pose after pose, then of
/// every landmark the three components of its measured less its predicted place.
struct Residuals {
  Eigen::VectorXd distance_mm;     ///< #R, > 0 where the scan lies outside the model
  Eigen::VectorXd sigma_mm;        ///< #R, of the scanner along the normal; of a landmark along the axis
  Points place;                    ///< #R by 3, the scan points; measured places of landmarks
  Points on_skin;                  ///< #R by 3, the closest points of the model's skin; predicted places of landmarks
  Table q;                         ///< #R by 2, anatomy coordinates (Anatomy::chart) of the closest skin point
  Eigen::VectorXi pose;            ///< #R, row of MeasuredScene::measurements
  Eigen::VectorXi point;           ///< #R, row of its scan; of a landmark 3 × row of MeasuredLandmarks + axis
  Eigen::Index landmark_rows = 0;  ///< the last of them

  Eigen::Index size() const { return distance_mm.size(); }
  Eigen::Index skin_rows() const { return size() - landmark_rows; }
  bool is_landmark(Eigen::Index row) const { return row >= skin_rows(); }
  /// Distances to the skin alone.
  auto skin_mm() const { return distance_mm.head(skin_rows()); }
  /// Without the landmarks.
  Residuals skin() const;
  /// What rows with the same one have alike: 0 distances to the skin, 1 to 3 the axes of landmarks.
  int kind(Eigen::Index row) const { return is_landmark(row) ? 1 + point[row] % 3 : 0; }
};

/// Landmarks of the scene always take part.
/// @param noise_mm  of the scanner, per measurement
Residuals residuals_of(const MeasuredScene& scene, const Prediction& prediction, const PointMask& mask,
                       const std::vector<double>& noise_mm);

/// Columns ∂d/∂u of the residuals with respect to the coordinates of some parameters, and how the shapes move.
struct Linearisation {
  Eigen::MatrixXd slope;                                   ///< #R by #parameters, mm per coordinate
  std::vector<simulation::ChainDerivative> by_coordinate;  ///< per coordinate
};

/// @param sensitivities  of the prediction's solution
Linearisation linearise(Evaluator& evaluator, const simulation::Sensitivities& sensitivities,
                        const FreeParameters& parameters, const Eigen::VectorXd& u, const Prediction& prediction,
                        const Residuals& residuals);

/// ∂d/∂(parameter value) at the residuals' points.
Eigen::VectorXd slope_at(Evaluator& evaluator, const simulation::Model& model, const Prediction& prediction,
                         const Residuals& residuals, const std::string& parameter,
                         const simulation::ChainDerivative& derivative);

/// Change of the residuals' distances when the nodes of each pose move, by the envelope theorem (signed_distance.h).
/// @param moves  per pose, #N by 3, mm; empty where nothing moves
Eigen::VectorXd distance_change(const Prediction& prediction, const Residuals& residuals,
                                const std::vector<Points>& moves);

}  // namespace supine::calibration
