// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "pipeline/case/case.h"
#include "pipeline/case/model_file.h"
#include "pipeline/tool/tool.h"
#include "simulation/model.h"

namespace supine::pipeline {

/// What every prediction starts from: the case, what is believed of its tissue, and its imaged mesh.
struct CaseInputs {
  Case description;
  ModelText model_text;
  simulation::Model model;  ///< what model_text says
  meshing::TetMesh mesh;
  meshing::Anatomy anatomy;  ///< of the mesh
};

/// @throws InputError  a model that is not this body's: check_weight()
void check_inputs(const CaseInputs& inputs);

/// Reads and checks the files, and notes them as inputs of the run. Warns of a mesh whose sidecars say that it was made
/// of another image than the case has.
/// @param folder      of case.toml
/// @param mesh_file   as supine-tetrahedralise writes it
/// @param model_file  empty: FOLDER/model.toml
/// @throws InputError  as the readers of the files; check_inputs()
CaseInputs read_case_inputs(Run& run, const std::filesystem::path& folder, const std::filesystem::path& mesh_file,
                            const std::filesystem::path& model_file);

}  // namespace supine::pipeline
