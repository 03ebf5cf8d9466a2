// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace supine::meshing {
class MuscleDistance;
struct TetMesh;
}  // namespace supine::meshing

namespace supine::simulation {

/// Where each node goes when the imaged skin moves out by 1 mm along its normal: 3 per node, xyz, mm per mm; linear, so
/// that any other offset is a multiple.
///
/// Skin nodes move along their area-weighted normal. Nodes of the inner surface, the ligament and the cut stay, those
/// that the skin shares with them too; next to them, and where the tissue over the muscle is thin, the skin's motion
/// fades over 10 mm. Corners inside follow harmonically (graph Laplacian with weights 1/length²: no node moves further
/// than the skin does). Middles of quadratic edges move by the mean of their ends, on the skin too, which shortens
/// their way by the cosine of half the turn between the ends' normals: bending the edge by what the fading bends would
/// turn thin elements inside out.
/// @param mesh  imaged, linear or quadratic
Eigen::VectorXd skin_offset(const meshing::TetMesh& mesh, const meshing::MuscleDistance& muscle);

}  // namespace supine::simulation
