// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "common/outputs.h"
#include "pipeline/work/simulate.h"
#include "python/bindings/arrays.h"
#include "python/bindings/engine_run.h"
#include "python/bindings/json.h"
#include "python/bindings/objects.h"
#include "simulation/embedding.h"

namespace supine::python {

namespace py = pybind11;

namespace {

/// supine.Simulation.
struct Simulation {
  pipeline::CaseInputs inputs;
  pipeline::Simulated simulated;
  bool certain = false;
  std::vector<std::string> warnings;
};

std::unique_ptr<Simulation> simulate(const pipeline::Case& description, const Mesh& mesh, const Model& model,
                                     std::vector<std::string> poses, std::string inverse, py::object progress) {
  EngineRun engine("simulate", std::move(progress));
  auto result = engine.call([&](pipeline::Run& run) {
    auto made = std::make_unique<Simulation>();
    made->inputs = inputs_of(description, mesh, model);
    pipeline::warn_of_locking(run, made->inputs);
    made->simulated = pipeline::simulate(run, made->inputs, {std::move(poses), std::move(inverse)});
    made->certain = pipeline::judge(run, made->simulated) == pipeline::Outcome::done;
    return made;
  });
  result->warnings = engine.warnings();
  return result;
}

std::vector<std::string> names_of(const Simulation& self) {
  std::vector<std::string> names;
  for (const auto& load : self.simulated.loads) names.push_back(load.name);
  if (names.front() != simulation::free_of_load) names.insert(names.begin() + 1, simulation::free_of_load);
  return names;
}

py::array shape(const py::object& self, const std::string& name) {
  return view_of(pipeline::shape_of(self.cast<const Simulation&>().simulated, name), self);
}

void write(const Simulation& self, const std::string& name, const std::filesystem::path& file, bool force) {
  const py::gil_scoped_release free;
  Outputs outputs(force);
  pipeline::write_shape(self.inputs, self.simulated, name, outputs.stage(file));
  outputs.commit();
}

py::array carry(const Simulation& self, const DoubleArray& points, const std::string& name) {
  const simulation::Embedding embedding(self.inputs.mesh, points_of(points, "points"));
  return copy_of(embedding.at(pipeline::shape_of(self.simulated, name)));
}

}  // namespace

void bind_simulation(py::module_& module) {
  py::class_<Simulation>(
      module, "Simulation",
      "The shapes of a body in every pose. simulation[\"supine\"] is a shape: N by 3, mm, a view that "
      "cannot be written.")
      .def("__getitem__", &shape, py::arg("shape"))
      .def_property_readonly("shapes", &names_of, "Names: the imaged pose, undeformed, and the others.")
      .def_property_readonly(
          "certain", [](const Simulation& self) { return self.certain; },
          "Whether the round trip ended where it began and every pose has one balanced shape: "
          "supine-simulate then ends with 0, else with 1.")
      .def_property_readonly("round_trip_max_mm",
                             [](const Simulation& self) { return self.simulated.solution.round_trip_max_mm; })
      .def_readonly("warnings", &Simulation::warnings)
      .def(
          "figures",
          [](const Simulation& self, const std::string& name) {
            return python_of(pipeline::shape_figures(self.inputs, self.simulated, name));
          },
          py::arg("shape"), "The figures of the sidecar SHAPE.json of supine-simulate.")
      .def("carry", &carry, py::arg("points"), py::arg("shape"),
           "Where points of the imaged body (P by 3, mm) are in a shape: P by 3, mm.")
      .def("write", &write, py::arg("shape"), py::arg("file"), py::arg("force") = false,
           "Writes the shape as supine-simulate writes SHAPE.vtu.")
      .def("__repr__", [](const Simulation& self) {
        return fmt::format("<supine.Simulation of {}: {}>", self.inputs.description.name,
                           py::str(", ").attr("join")(names_of(self)).cast<std::string>());
      });
  module.def("simulate", &simulate, py::arg("case"), py::arg("mesh"), py::arg("model"), py::kw_only(),
             py::arg("poses") = std::vector<std::string>(), py::arg("inverse") = "newton",
             py::arg("progress") = py::none(),
             "Finds the undeformed shape and from it the shape in every pose (or in `poses`), as supine-simulate "
             "does.\n\n"
             "inverse: newton, fixed-point or reversed-gravity. progress: called with a line of text.");
}

}  // namespace supine::python
