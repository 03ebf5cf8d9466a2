// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "calibration/evaluator.h"
#include "tests/simulation/scene.h"

namespace supine::testing {

/// A small breast whose supine scan is the engine's own prediction for known numbers, so that every answer is known.
struct Twin {
  struct Options {
    simulation::Model truth;  ///< the scan is its prediction
    double noise_mm = 0;      ///< added along the skin's normal, seeded
    unsigned seed = 1;
    double shrink = 0.7;  ///< scan triangles about their centres: closest points lie inside the skin's triangles
    double left_out_from_x = 1e9;                             ///< a hole: no scan where x is beyond this
    bool reversed = false;                                    ///< points and triangles in the opposite order
    Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< everything seen from elsewhere
    const TestScene* body = nullptr;                          ///< another body than dome_scene()
  };

  explicit Twin(const Options& options);

  meshing::TetMesh mesh;
  meshing::Anatomy anatomy;
  simulation::PoseLoad prone, supine;
  simulation::ChainSolution solution;  ///< of the truth
  std::unique_ptr<calibration::Measurement> measurement;
  calibration::MeasuredScene scene() const { return {&mesh, &anatomy, prone, {measurement.get()}}; }
};

/// Moduli that the tests take for true, both free around another start.
simulation::Model twin_truth();
simulation::Model twin_start();

}  // namespace supine::testing
