// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <fstream>

#include "common/error.h"
#include "common/outputs.h"
#include "common/suggestion.h"
#include "pipeline/case/model_edit.h"
#include "python/bindings/objects.h"
#include "simulation/parameters.h"

namespace supine::python {

namespace py = pybind11;

namespace {

/// Every number of the model by name: those of its laws, then those of its effects.
std::vector<std::string> names_of(const simulation::Model& model) {
  std::vector<std::string> names;
  for (const simulation::Parameter& row : simulation::base_parameters())
    if (simulation::why_not_of(model, row.name).empty()) names.push_back(row.name);
  for (const auto& setting : model.effects)
    for (const auto& row : simulation::find_effect(setting.name)->parameters())
      names.push_back(simulation::parameter_name(*simulation::find_effect(setting.name), row));
  return names;
}

const simulation::Setting& setting_of(const Model& self, const std::string& name) {
  // find_setting() takes what may be changed; this is not.
  if (const auto* setting = simulation::find_setting(const_cast<simulation::Model&>(self.model()), name))
    return *setting;
  const std::vector<std::string> names = names_of(self.model());
  const std::string nearest = nearest_name(name, names);
  throw InputError(fmt::format("{}: the model has no number {}; {}", self.text().file.string(), name,
                               nearest.empty() ? "there are " + listed(names) : "did you mean " + nearest + "?"));
}

py::dict setting(const Model& self, const std::string& name) {
  const simulation::Setting& found = setting_of(self, name);
  py::dict said;
  said["value"] = found.value;
  said["unit"] = simulation::find_parameter(name)->unit;
  said["free"] = found.free;
  said["prior_sd"] = found.prior_sd ? py::object(py::float_(*found.prior_sd)) : py::none();
  said["lower"] = found.lower;
  said["upper"] = found.upper;
  return said;
}

py::list effects(const Model& self) {
  py::list names;
  for (const auto& effect : self.model().effects) names.append(effect.name);
  return names;
}

void write(const Model& self, const std::filesystem::path& file, bool force) {
  Outputs outputs(force);
  std::ofstream stream(outputs.stage(file), std::ios::binary);
  stream << self.text().text;
  if (!stream.flush())
    throw InputError(fmt::format("writing {} failed; check the free space on the disk", file.string()));
  outputs.commit();
}

/// What reads and changes the model.
void bind_numbers(py::class_<Model>& bound) {
  bound
      .def(
          "__getitem__", [](const Model& self, const std::string& name) { return setting_of(self, name).value; },
          py::arg("name"))
      .def(
          "__setitem__",
          [](Model& self, const std::string& name, double value) {
            self.set({{name, value}});
          },
          py::arg("name"), py::arg("value"))
      .def("set", &Model::set, py::arg("values"), "Sets several numbers, by name: all of them or, with an error, none.")
      .def("setting", &setting, py::arg("name"), "value, unit, free, prior_sd, lower and upper of a number.")
      .def(
          "add",
          [](Model& self, const std::string& name) {
            self.replace({self.text().file, pipeline::with_effect(self.text(), name)});
          },
          py::arg("effect"), "Adds an effect of the catalogue, all of it free, as supine-model add does.")
      .def(
          "remove",
          [](Model& self, const std::string& name) {
            self.replace({self.text().file, pipeline::without_effect(self.text(), name)});
          },
          py::arg("effect"), "Removes an effect, as supine-model remove does.")
      .def("copy", [](const Model& self) { return Model(self); })
      .def("__copy__", [](const Model& self) { return Model(self); })
      .def("write", &write, py::arg("file"), py::arg("force") = false,
           "Writes the text; force replaces a file that is there.")
      .def("__repr__", [](const Model& self) {
        return fmt::format("<supine.Model {}: {} numbers, {} effects>", self.text().file.string(),
                           names_of(self.model()).size(), self.model().effects.size());
      });
}

}  // namespace

void Model::replace(pipeline::ModelText text) {
  simulation::Model model = pipeline::read_model(text);
  text_ = std::move(text);
  model_ = std::move(model);
}

void Model::set(const std::map<std::string, double>& values) {
  for (const auto& [name, value] : values) setting_of(*this, name);
  replace({text_.file, pipeline::with_values(text_, values)});
}

pipeline::CaseInputs inputs_of(const pipeline::Case& description, const Mesh& mesh, const Model& model) {
  pipeline::CaseInputs inputs{description, model.text(), model.model(), mesh.mesh, mesh.anatomy};
  pipeline::check_inputs(inputs);
  return inputs;
}

void bind_model(py::module_& module) {
  py::class_<Model> bound(
      module, "Model",
      "What is believed of the tissue: a model.toml.\n\n"
      "model[\"breast.young_modulus_kpa\"] reads a number and sets it. What is set is checked as the "
      "tools check the file, comments stay, and write() gives the file back.");
  bound
      .def(py::init([](const std::filesystem::path& file) { return Model(pipeline::read_model_text(file)); }),
           py::arg("file"), "Reads and checks a model.toml.")
      .def_static(
          "from_text",
          [](std::string text, const std::filesystem::path& file) {
            return Model({file, std::move(text)});
          },
          py::arg("text"), py::arg("file") = "model.toml", "A model of a text; messages name `file`.")
      .def_property_readonly("file", [](const Model& self) { return self.text().file; })
      .def_property_readonly(
          "text", [](const Model& self) { return self.text().text; }, "The text of the file.")
      .def_property_readonly(
          "names", [](const Model& self) { return names_of(self.model()); },
          "Names of all its numbers; each ends in its unit where it has one.")
      .def_property_readonly(
          "free", [](const Model& self) { return simulation::free_parameters(self.model()); },
          "Names of what a calibration fits.")
      .def_property_readonly("effects", &effects, "Names of its effects.");
  bind_numbers(bound);
}

}  // namespace supine::python
