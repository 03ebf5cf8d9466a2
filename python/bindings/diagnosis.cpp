// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/ranges.h>
#include <pybind11/stl.h>

#include "pipeline/work/diagnose.h"
#include "python/bindings/engine_run.h"
#include "python/bindings/json.h"
#include "python/bindings/objects.h"

namespace supine::python {

namespace py = pybind11;

namespace {

/// supine.Diagnosis. What the result points to stands before it.
struct Diagnosis {
  pipeline::CaseToDiagnose subject;
  pipeline::DiagnosisResult result;
  std::vector<std::string> warnings;
};

std::unique_ptr<Diagnosis> diagnose(const pipeline::Case& description, const Mesh& mesh, const Model& model,
                                    const pipeline::DiagnoseOptions& options, py::object progress) {
  options.check();
  EngineRun engine("diagnose", std::move(progress));
  auto made = engine.call([&](pipeline::Run& run) {
    auto diagnosis = std::make_unique<Diagnosis>();
    diagnosis->subject = pipeline::measure_to_diagnose(run, inputs_of(description, mesh, model), options.without);
    pipeline::LiveProgress live(run, std::chrono::seconds(0));
    diagnosis->result =
        pipeline::diagnose(run, diagnosis->subject, pipeline::examine_options(diagnosis->subject, options, live), live);
    return diagnosis;
  });
  made->warnings = engine.warnings();
  return made;
}

py::dict probabilities(const Diagnosis& self) {
  py::dict by_effect;
  for (const auto& included : self.result.found->included) by_effect[py::str(included.effect)] = included.probability;
  return by_effect;
}

}  // namespace

void bind_diagnosis(py::module_& module) {
  py::class_<Diagnosis>(module, "Diagnosis", "Which effect a calibrated model lacks, and how sure that is.")
      .def_property_readonly(
          "verdict",
          [](const Diagnosis& self) { return diagnosis::verdict_name(self.result.found->diagnosis.verdict); },
          "nothing_missing, missing, ambiguous or unexplained.")
      .def_property_readonly(
          "missing", [](const Diagnosis& self) { return self.result.found->diagnosis.missing; },
          "Names of effects; all of the set when ambiguous, the best of the catalogue when "
          "unexplained.")
      .def_property_readonly("why", [](const Diagnosis& self) { return self.result.found->diagnosis.why; })
      .def_property_readonly("probabilities", &probabilities, "By effect, the likeliest first.")
      .def_property_readonly(
          "figures", [](const Diagnosis& self) { return python_of(pipeline::diagnosis_figures(self.result)); },
          "The figures of diagnosis.json.")
      .def_readonly("warnings", &Diagnosis::warnings)
      .def("__repr__", [](const Diagnosis& self) {
        const auto& found = self.result.found->diagnosis;
        return fmt::format("<supine.Diagnosis of {}: {} {}>", self.subject.measured->description.name,
                           diagnosis::verdict_name(found.verdict), fmt::join(found.missing, ", "));
      });
  module.def(
      "diagnose",
      [](const pipeline::Case& description, const Mesh& mesh, const Model& model, int refits, bool other_meshes,
         unsigned seed, std::optional<double> registration_mm, std::optional<double> segmentation_mm,
         std::optional<double> chest_wall_mm, std::vector<double> prior, double unlisted,
         std::vector<std::string> without, py::object progress) {
        return diagnose(description, mesh, model,
                        {refits,
                         other_meshes,
                         seed,
                         {registration_mm, segmentation_mm, chest_wall_mm},
                         unlisted,
                         std::move(prior),
                         std::move(without)},
                        std::move(progress));
      },
      py::arg("case"), py::arg("mesh"), py::arg("model"), py::kw_only(), py::arg("refits") = 5,
      py::arg("other_meshes") = true, py::arg("seed") = 1, py::arg("registration_mm") = py::none(),
      py::arg("segmentation_mm") = py::none(), py::arg("chest_wall_mm") = py::none(),
      py::arg("prior") = std::vector<double>(), py::arg("unlisted") = 0.1,
      py::arg("without") = std::vector<std::string>(), py::arg("progress") = py::none(),
      "Asks what a calibrated model lacks, as supine-diagnose does. Priors stand in the case's own model.toml where it "
      "has the same free numbers.\n\n"
      "registration_mm, segmentation_mm, chest_wall_mm: 1 sigma. prior: probabilities of nothing, one, two and three "
      "effects. unlisted: that of a local cause that no effect lists. without: of discrepancy, nuisances, patchiness "
      "and landmarks, what is examined as if there were none.");
}

}  // namespace supine::python
