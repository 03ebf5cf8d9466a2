// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/solve/chain.h"

namespace supine::bench {

/// A breast-like body of about 1,350 linear tetrahedra on a curved muscle, leaning towards the feet.
struct RobustnessShape {
  double foot_radius_mm, height_mm, muscle_radius_mm, lean_deg;
  meshing::TetMesh mesh;
  meshing::Anatomy anatomy;
  std::vector<simulation::PoseLoad> poses;  ///< prone and supine, each tilted by its own angle up to 15 degrees
};

inline constexpr int robustness_shapes = 20, robustness_sets = 200;

/// Shape @p index of robustness_shapes: height 20 to 80 mm, foot radius 45 to 75 mm, muscle radius 90 to 300 mm, lean
/// up to 25 degrees. The same on every machine.
RobustnessShape robustness_shape(int index);

/// Parameter set @p set of robustness_sets: every bulk and skin law, E 0.2 to 5 kPa and skin 1 to 100 kPa (times 1.5
/// mm) evenly in the logarithm, ν 0.3 to 0.499 evenly. The same for every shape.
simulation::Model robustness_model(int set);

}  // namespace supine::bench
