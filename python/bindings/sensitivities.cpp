// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/sensitivities.h"

#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <fstream>
#include <limits>

#include "common/outputs.h"
#include "common/suggestion.h"
#include "pipeline/case/population_priors.h"
#include "pipeline/work/sensitivity.h"
#include "pipeline/work/simulate.h"
#include "python/bindings/arrays.h"
#include "python/bindings/engine_run.h"
#include "python/bindings/json.h"
#include "python/bindings/objects.h"
#include "simulation/parameters.h"

namespace supine::python {

namespace py = pybind11;

namespace {

/// supine.Sensitivities. What each member points to stands before it.
struct Sensitivities {
  pipeline::CaseInputs inputs;
  pipeline::Simulated simulated;
  std::unique_ptr<simulation::Chain> chain;
  std::unique_ptr<simulation::Sensitivities> exact;
};

std::unique_ptr<Sensitivities> sensitivities(const pipeline::Case& description, const Mesh& mesh, const Model& model,
                                             const std::vector<std::string>& poses, py::object progress) {
  EngineRun engine("sensitivities", std::move(progress));
  return engine.call([&](pipeline::Run& run) {
    auto made = std::make_unique<Sensitivities>();
    pipeline::CaseInputs& in = made->inputs;
    in = inputs_of(description, mesh, model);
    made->simulated.loads = pipeline::loads_of(in.description, poses);
    made->chain = std::make_unique<simulation::Chain>(in.mesh, in.anatomy, in.model, made->simulated.loads,
                                                      pipeline::solve_options(run));
    made->simulated.solution = made->chain->solve(in.model);
    made->exact = std::make_unique<simulation::Sensitivities>(*made->chain, in.model, made->simulated.solution);
    return made;
  });
}

py::array derivative(const Sensitivities& self, const std::string& parameter, const std::string& shape) {
  pipeline::shape_of(self.simulated, shape);  // refuses what there is not
  simulation::ChainDerivative move;
  {
    const py::gil_scoped_release free;
    move = self.exact->of(parameter);
  }
  if (shape == simulation::free_of_load) return copy_of(move.X);
  for (std::size_t p = 0; p < move.poses.size(); ++p)
    if (self.simulated.solution.poses[p].name == shape) return copy_of(move.poses[p]);
  return copy_of(move.prone);
}

py::dict gradient(const Sensitivities& self, const std::map<std::string, DoubleArray>& by_pose,
                  std::optional<std::vector<std::string>> parameters) {
  const auto& poses = self.simulated.solution.poses;
  std::vector<Points> slopes(poses.size(), Points::Zero(self.inputs.mesh.points.rows(), 3));
  for (const auto& [name, slope] : by_pose) {
    const auto pose = std::find_if(poses.begin(), poses.end(), [&name](const auto& one) { return one.name == name; });
    std::vector<std::string> names;
    for (const auto& one : poses) names.push_back(one.name);
    if (pose == poses.end())
      throw InputError(fmt::format("there is no pose \"{}\"; there are {}", name, listed(names)));
    Points given = points_of(slope, "the gradient of " + name);
    if (given.rows() != self.inputs.mesh.points.rows())
      throw InputError(fmt::format("the gradient of {}: {} rows for {} points of the mesh", name, given.rows(),
                                   self.inputs.mesh.points.rows()));
    slopes[static_cast<std::size_t>(pose - poses.begin())] = std::move(given);
  }
  const auto names = parameters.value_or(simulation::free_parameters(self.inputs.model));
  Eigen::VectorXd found;
  {
    const py::gil_scoped_release free;
    found = self.exact->gradient(slopes, names);
  }
  py::dict by_name;
  for (std::size_t i = 0; i < names.size(); ++i) by_name[py::str(names[i])] = found[static_cast<Eigen::Index>(i)];
  return by_name;
}

/// supine.Draws.
struct Draws {
  std::optional<calibration::FreeParameters> parameters;
  std::string law;
  calibration::Draws drawn;
  pipeline::SensitivityRows rows;
};

std::unique_ptr<Draws> draw(const pipeline::Case& description, const Mesh& mesh, const Model& model, int samples,
                            const std::string& law, unsigned seed, py::object progress) {
  EngineRun engine("draw", std::move(progress));
  return engine.call([&](pipeline::Run& run) {
    const auto measured = pipeline::measure_case(run, inputs_of(description, mesh, model));
    auto made = std::make_unique<Draws>();
    made->law = law;
    made->parameters.emplace(pipeline::with_population(run, measured->description, measured->model));
    made->drawn = pipeline::draw(run, *made->parameters, law, samples, seed);
    calibration::RunJournal nothing;
    made->rows =
        pipeline::run_draws(run, *measured, *made->parameters, made->drawn, {0, made->drawn.values.size()}, nothing);
    return made;
  });
}

py::array values_of(const Draws& self) {
  Table values(static_cast<Eigen::Index>(self.rows.values.size()), self.parameters->size());
  for (Eigen::Index i = 0; i < values.rows(); ++i)
    values.row(i) = self.rows.values[static_cast<std::size_t>(i)].transpose();
  return copy_of(values);
}

auto errors_of(double calibration::RunResult::*figure) {
  return [figure](const Draws& self) {
    Eigen::VectorXd errors(static_cast<Eigen::Index>(self.rows.results.size()));
    for (Eigen::Index i = 0; i < errors.size(); ++i) {
      const calibration::RunResult& result = self.rows.results[static_cast<std::size_t>(i)];
      errors[i] = result.failed ? std::numeric_limits<double>::quiet_NaN() : result.*figure;
    }
    return copy_of(errors);
  };
}

void write(const Draws& self, const std::filesystem::path& file, bool force) {
  Outputs outputs(force);
  std::ofstream stream(outputs.stage(file), std::ios::binary);
  pipeline::write_sensitivity(self.rows, self.parameters->names(), stream);
  stream.close();
  outputs.commit();
}

void bind_exact(py::module_& module) {
  py::class_<Sensitivities>(module, "Sensitivities",
                            "Exact derivatives of the shapes with respect to any number of the model or of the "
                            "catalogue, through the inverse and every pose.")
      .def("derivative", &derivative, py::arg("parameter"), py::arg("shape"),
           "N by 3: mm per unit of the parameter. Of an effect that the model has not: at its null.")
      .def("gradient", &gradient, py::arg("by_pose"), py::arg("parameters") = py::none(),
           "dJ/d(parameter) by name of a J of which dJ/dx is given by pose (N by 3, per mm), by the adjoint method. "
           "parameters: default the free ones.")
      .def(
          "__getitem__",
          [](const py::object& self, const std::string& name) {
            return view_of(pipeline::shape_of(self.cast<const Sensitivities&>().simulated, name), self);
          },
          py::arg("shape"), "N by 3, mm: the shape itself.");
  module.def("sensitivities", &sensitivities, py::arg("case"), py::arg("mesh"), py::arg("model"), py::kw_only(),
             py::arg("poses") = std::vector<std::string>(), py::arg("progress") = py::none(),
             "Solves the chain and gives what its derivatives are asked of.");
}

void bind_draws(py::module_& module) {
  py::class_<Draws>(module, "Draws",
                    "Chain runs for numbers drawn from what the model believes of them. S draws, P "
                    "parameters.")
      .def_property_readonly("names", [](const Draws& self) { return self.parameters->names(); })
      .def_property_readonly("values", &values_of, "S by P, in the parameters' units.")
      .def_property_readonly("mae_study_mm", errors_of(&calibration::RunResult::mae_study_mm),
                             "S, mm: the study's MAE, model to scan; NaN without equilibrium.")
      .def_property_readonly("mae_mm", errors_of(&calibration::RunResult::mae_mm), "S, mm: MAE, scan to model.")
      .def_property_readonly("rms_mm", errors_of(&calibration::RunResult::rms_mm), "S, mm: RMS, scan to model.")
      .def_property_readonly(
          "figures",
          [](const Draws& self) {
            return python_of(pipeline::sensitivity_figures(*self.parameters, self.law, self.drawn, self.rows));
          },
          "The figures of sensitivity.json.")
      .def("write", &write, py::arg("file"), py::arg("force") = false, "Writes sensitivity.csv.");
  module.def("draw", &draw, py::arg("case"), py::arg("mesh"), py::arg("model"), py::kw_only(),
             py::arg("samples") = 1000, py::arg("law") = "prior", py::arg("seed") = 1, py::arg("progress") = py::none(),
             "Draws the free numbers and runs the chain for each draw, as supine-sensitivity does. law: prior or "
             "normal.");
}

}  // namespace

void bind_sensitivities(py::module_& module) {
  bind_exact(module);
  bind_draws(module);
}

}  // namespace supine::python
