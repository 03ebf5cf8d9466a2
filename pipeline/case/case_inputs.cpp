// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case_inputs.h"

#include <fmt/core.h>

#include "meshing/imaged_mesh.h"
#include "pipeline/case/model_checks.h"

namespace supine::pipeline {

namespace fs = std::filesystem;

void check_inputs(const CaseInputs& inputs) {
  if (!inputs.description.is_object()) check_weight(inputs.model, inputs.anatomy, inputs.model_text.file);
}

CaseInputs read_case_inputs(Run& run, const fs::path& folder, const fs::path& mesh_file, const fs::path& model_file) {
  run.input(folder / "case.toml");
  CaseInputs inputs{read_case(folder), {}, {}, {}, {}};
  inputs.model_text = read_model_text(run.input(model_file.empty() ? folder / "model.toml" : model_file));
  inputs.model = read_model(inputs.model_text);
  inputs.mesh = meshing::read_imaged_mesh(run.input(mesh_file), inputs.description.side);
  inputs.anatomy = meshing::compute_anatomy(inputs.mesh, inputs.description.side, inputs.description.imaged_pose);
  check_inputs(inputs);
  if (const std::string doubt = doubt_of_skin(inputs.model); !inputs.description.is_object() && !doubt.empty())
    run.warn(fmt::format("{}: {}", inputs.model_text.file.string(), doubt));
  return inputs;
}

}  // namespace supine::pipeline
