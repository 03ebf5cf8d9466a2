// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case_inputs.h"

#include <fmt/core.h>

#include "meshing/imaged_mesh.h"
#include "pipeline/case/model_checks.h"
#include "pipeline/tool/lineage.h"

namespace supine::pipeline {

namespace fs = std::filesystem;

namespace {

/// The image that @p mesh was made of by way of the labels beside it, where sidecars tell, against that of the case.
void warn_of_another_image(Run& run, const Case& description, const fs::path& mesh) {
  const fs::path labels = mesh.parent_path() / "labels.vti";
  const bool its_labels = fs::exists(labels) && !made_from_another(mesh, labels);
  if (!made_from_another(mesh, description.image_file) &&
      !(its_labels && made_from_another(labels, description.image_file)))
    return;
  run.warn(fmt::format(
      "{} was made from another {} than {} is now: it may be another body, or the image was changed since; make "
      "CASE={} mesh makes it again",
      mesh.string(), description.image_file.filename().string(), description.image_file.string(),
      description.folder.string()));
}

}  // namespace

void check_inputs(const CaseInputs& inputs) {
  if (!inputs.description.is_object()) check_weight(inputs.model, inputs.anatomy, inputs.model_text.file);
}

CaseInputs read_case_inputs(Run& run, const fs::path& folder, const fs::path& mesh_file, const fs::path& model_file) {
  run.input(folder / "case.toml");
  CaseInputs inputs{read_case(folder), {}, {}, {}, {}};
  inputs.model_text = read_model_text(run.input(model_file.empty() ? folder / "model.toml" : model_file));
  inputs.model = read_model(inputs.model_text);
  inputs.mesh = meshing::read_imaged_mesh(run.input(mesh_file), inputs.description.side);
  warn_of_another_image(run, inputs.description, mesh_file);
  inputs.anatomy = meshing::compute_anatomy(inputs.mesh, inputs.description.side, inputs.description.imaged_pose);
  check_inputs(inputs);
  if (const std::string doubt = doubt_of_skin(inputs.model); !inputs.description.is_object() && !doubt.empty())
    run.warn(fmt::format("{}: {}", inputs.model_text.file.string(), doubt));
  return inputs;
}

}  // namespace supine::pipeline
