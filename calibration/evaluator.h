// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/distance_figures.h"
#include "calibration/free_parameters.h"
#include "calibration/measured_landmarks.h"
#include "calibration/model_skin.h"
#include "calibration/scan.h"
#include "calibration/scan_motion.h"
#include "calibration/signed_distance.h"
#include "simulation/embedding.h"
#include "simulation/solve/chain.h"
#include "simulation/solve/sensitivities.h"

namespace supine::calibration {

/// A measured surface and the pose it was measured in.
struct Measurement {
  simulation::PoseLoad pose;
  Scan scan;
  std::optional<double> noise_mm;  ///< of the scanner along the normal, 1 sigma; none = to be estimated
  std::vector<int> left_out = {};  ///< scan points that say nothing: they count as beyond the skin's border
};

/// What does not change while parameters do. Everything it points to must outlive its users.
struct MeasuredScene {
  const meshing::TetMesh* mesh;
  const meshing::Anatomy* anatomy;
  simulation::PoseLoad prone;
  std::vector<const Measurement*> measurements;  ///< those that are fitted, or looked at; one or more
  /// Measured with them, by measurement; nullptr where there are none. Shorter where the last ones have none.
  std::vector<const MeasuredLandmarks*> landmarks = {};
};

/// The landmarks of one measured pose as a model predicts them, #L by 3, mm.
struct LandmarkPrediction {
  Points measured;                                  ///< as the model says they lie (ScanMotion of their scan)
  Points predicted;                                 ///< carried along by the tissue
  std::shared_ptr<const simulation::Embedding> in;  ///< the mesh; nullptr without landmarks
};

/// One measured pose as a model predicts it.
struct PosePrediction {
  Points scan_points;         ///< as the model says they lie (ScanMotion), #P by 3
  SignedDistances distances;  ///< of them to the model's skin
  ModelToScan to_scan;        ///< of the skin's points to the scan
  LandmarkPrediction landmarks;
};

/// One model's prediction of everything measured, in the order of MeasuredScene::measurements.
struct Prediction {
  simulation::ChainSolution solution;
  std::vector<PosePrediction> poses;

  /// The study's S13 over the covered skin points of all poses; NaN without any.
  double mae_study_mm() const;
  /// Signed distances of the scan points that are not beyond the model, all poses.
  std::vector<double> scan_distances() const;
};

/// Runs the chain for one set of numbers after the other and measures its distance to the scans. Work and memory are
/// kept between calls. One per thread.
class Evaluator {
 public:
  /// @param model  sets the kind of model (laws, boundaries); later ones may differ in numbers and effects
  Evaluator(MeasuredScene scene, const simulation::Model& model, const simulation::SolveOptions& options = {});

  /// @param near  solution to start from, or nullptr
  /// @throws NumericalFailure  no equilibrium
  Prediction predict(const simulation::Model& model, const simulation::ChainSolution* near = nullptr);

  /// ∂d/∂(parameter) of every scan point of one measurement, by the envelope theorem (signed_distance.h).
  /// @param derivative  of the chain with respect to the parameter
  Eigen::VectorXd distance_derivative(const simulation::Model& model, const Prediction& prediction, std::size_t pose,
                                      const std::string& parameter, const simulation::ChainDerivative& derivative);
  /// ∂(measured − predicted)/∂(parameter) of the landmarks of one measurement, #L by 3.
  Points landmark_derivative(const simulation::Model& model, const Prediction& prediction, std::size_t pose,
                             const std::string& parameter, const simulation::ChainDerivative& derivative);

  simulation::Chain& chain() { return chain_; }
  const MeasuredScene& scene() const { return scene_; }

 private:
  MeasuredScene scene_;
  simulation::Chain chain_;
  std::vector<ModelSkin> skins_;
  std::vector<std::shared_ptr<const simulation::Embedding>> landmarks_;  // by measurement
};

/// Moves every shape of a solution by a first-order step of a number, in its unit.
void move_along(const simulation::ChainDerivative& derivative, double step, simulation::ChainSolution& solution);

/// The solution moved by first-order steps of the parameters: where to start looking for the next one.
simulation::ChainSolution extrapolated(const simulation::ChainSolution& solution,
                                       const std::vector<simulation::ChainDerivative>& by_coordinate,
                                       const Eigen::VectorXd& step);

}  // namespace supine::calibration
