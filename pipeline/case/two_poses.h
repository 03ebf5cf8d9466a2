// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"
#include "warp/warp_volume.h"

namespace supine::pipeline {

/// The shapes of a case in two poses, as supine-simulate wrote them.
struct TwoPoses {
  std::string from, to;
  meshing::PoseMesh source;  ///< of `from`; its mesh is that of both
  Points target;             ///< of `to`

  warp::TwoShapes shapes() const { return {source.mesh, source.positions, target}; }
};

/// Reads FOLDER/FROM.vtu and FOLDER/TO.vtu; `undeformed` is a pose here. Cells that are inside out in either are warned
/// of, with their place.
/// @throws InputError  no such pose; the same twice; a pose that was not solved, with the command that solves it; two
///   meshes
TwoPoses read_two_poses(Run& run, const Case& measured, const std::filesystem::path& folder, const std::string& from,
                        const std::string& to);

}  // namespace supine::pipeline
