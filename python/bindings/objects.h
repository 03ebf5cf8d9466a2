// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/case/case_inputs.h"

namespace supine::python {

/// supine.Mesh: an imaged mesh with the anatomy of its case.
struct Mesh {
  std::filesystem::path file;
  meshing::TetMesh mesh;
  meshing::Anatomy anatomy;
};

/// supine.Model: the text of a model file and what it says, which change together.
class Model {
 public:
  /// @throws InputError  as pipeline::read_model()
  explicit Model(pipeline::ModelText text) { replace(std::move(text)); }

  const pipeline::ModelText& text() const { return text_; }
  const simulation::Model& model() const { return model_; }

  /// @throws InputError  names and bounds as pipeline::read_model(); the model stays as it was
  void replace(pipeline::ModelText text);
  void set(const std::map<std::string, double>& values);

 private:
  pipeline::ModelText text_;
  simulation::Model model_;
};

/// @throws InputError  objects that do not belong together: pipeline::check_inputs()
pipeline::CaseInputs inputs_of(const pipeline::Case& description, const Mesh& mesh, const Model& model);

void bind_case(pybind11::module_& module);
void bind_mesh(pybind11::module_& module);
void bind_model(pybind11::module_& module);
void bind_simulation(pybind11::module_& module);
void bind_calibration(pybind11::module_& module);
void bind_sensitivities(pybind11::module_& module);
void bind_diagnosis(pybind11::module_& module);

}  // namespace supine::python
