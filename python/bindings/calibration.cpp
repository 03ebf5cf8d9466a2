// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>
#include <pybind11/stl.h>

#include <list>

#include "pipeline/work/calibrate.h"
#include "pipeline/work/simulate.h"
#include "python/bindings/arrays.h"
#include "python/bindings/engine_run.h"
#include "python/bindings/json.h"
#include "python/bindings/objects.h"
#include "python/bindings/own.h"

namespace supine::python {

namespace py = pybind11;

namespace {

/// supine.Calibration. What the result points to stands before it.
struct Calibration {
  std::unique_ptr<pipeline::MeasuredCase> measured;
  std::optional<calibration::FreeParameters> parameters;
  pipeline::CalibrationResult result;
  bool converged = false;
  std::vector<std::string> warnings;
};

std::unique_ptr<Calibration> calibrate(const pipeline::Case& description, const Mesh& mesh, const Model& model,
                                       pipeline::CalibrateOptions options, const std::vector<py::object>& residuals,
                                       py::object progress) {
  std::list<PythonResidual> own;
  for (const py::object& residual : residuals) options.own.push_back(&own.emplace_back(residual));
  options.choose_method();
  options.check();
  EngineRun engine("calibrate", std::move(progress));
  auto made = engine.call([&](pipeline::Run& run) {
    auto fit = std::make_unique<Calibration>();
    fit->measured = pipeline::measure_case(run, inputs_of(description, mesh, model));
    for (const PythonResidual& residual : own) residual.check_derivative(fit->measured->start);
    fit->parameters = pipeline::parameters_to_fit(run, *fit->measured, options);
    calibration::RunJournal nothing;
    fit->result = pipeline::calibrate(run, *fit->measured, *fit->parameters, options, nothing);
    fit->converged = pipeline::judge(run, options, fit->result) == pipeline::Outcome::done;
    return fit;
  });
  made->warnings = engine.warnings();
  return made;
}

py::dict values(const Calibration& self) {
  py::dict by_name;
  for (Eigen::Index i = 0; i < self.parameters->size(); ++i)
    by_name[py::str(self.parameters->names()[static_cast<std::size_t>(i)])] =
        self.parameters->value(i, self.result.fit.u[i]);
  return by_name;
}

py::dict history(const Calibration& self) {
  const auto& rows = self.result.fit.history;
  const auto column = [&rows](auto of) {
    Eigen::VectorXd numbers(static_cast<Eigen::Index>(rows.size()));
    for (Eigen::Index i = 0; i < numbers.size(); ++i)
      numbers[i] = static_cast<double>(of(rows[static_cast<std::size_t>(i)]));
    return copy_of(numbers);
  };
  py::dict columns;
  for (Eigen::Index p = 0; p < self.parameters->size(); ++p)
    columns[py::str(self.parameters->names()[static_cast<std::size_t>(p)])] =
        column([p](const auto& row) { return row.values[p]; });
  columns["mae_study_mm"] = column([](const auto& row) { return row.mae_study_mm; });
  columns["mae_mm"] = column([](const auto& row) { return row.mae_mm; });
  columns["rms_mm"] = column([](const auto& row) { return row.rms_mm; });
  columns["failed"] = column([](const auto& row) { return row.failed; });
  columns["accepted"] = column([](const auto& row) { return row.accepted; });
  return columns;
}

py::array shape(const py::object& self, const std::string& name) {
  const auto& fit = self.cast<const Calibration&>();
  return view_of(pipeline::shape_of(fit.result.fit.prediction.solution, fit.measured->description.imaged_pose, name),
                 self);
}

template <class Of>
auto view_as(Of of) {
  return [of](const py::object& self) { return view_of(of(self.cast<const Calibration&>().result), self); };
}

void bind_arrays(py::class_<Calibration>& bound) {
  using pipeline::CalibrationResult;
  bound
      .def_property_readonly("residuals_mm",
                             view_as([](const CalibrationResult& r) -> auto& { return r.fit.residuals.distance_mm; }),
                             "R, mm: signed distances of the scan's points, > 0 where the scan lies outside the model. "
                             "With joint the last rows are of landmarks, three each (figures['landmarks_used']).")
      .def_property_readonly("residual_places",
                             view_as([](const CalibrationResult& r) -> auto& { return r.fit.residuals.place; }),
                             "R by 3, mm: the scan's points.")
      .def_property_readonly("residual_sigma_mm",
                             view_as([](const CalibrationResult& r) -> auto& { return r.fit.residuals.sigma_mm; }),
                             "R, mm: noise of the scanner.")
      .def_property_readonly("residual_pose",
                             view_as([](const CalibrationResult& r) -> auto& { return r.fit.residuals.pose; }),
                             "R: row of Case.calibrated_poses.")
      .def_property_readonly("jacobian",
                             view_as([](const CalibrationResult& r) -> auto& { return r.fit.linearisation.slope; }),
                             "R by P: mm per coordinate, ln(value) where a parameter is positive.")
      .def_property_readonly("covariance",
                             view_as([](const CalibrationResult& r) -> auto& { return r.uncertainty.covariance; }),
                             "P by P, of the coordinates.");
}

void bind_class(py::module_& module) {
  py::class_<Calibration> bound(module, "Calibration",
                                "A calibrated model and what it is worth. R: rows of residuals, P: fitted parameters.");
  bound
      .def_property_readonly(
          "model",
          [](const Calibration& self) {
            return Model(pipeline::fitted_model(*self.measured, *self.parameters, self.result));
          },
          "The model with the fitted numbers in their places: the model.toml of supine-calibrate.")
      .def_property_readonly("values", &values, "The fitted numbers by name, in the unit that ends the name.")
      .def_property_readonly("names", [](const Calibration& self) { return self.parameters->names(); })
      .def_readonly("converged", &Calibration::converged,
                    "Whether the fit settled (and reached until_mae_mm): supine-calibrate then ends with 0, else "
                    "with 1.")
      .def_property_readonly(
          "figures",
          [](const Calibration& self) {
            return python_of(pipeline::calibration_figures(*self.measured, *self.parameters, self.result));
          },
          "The figures of calibration.json.")
      .def_property_readonly("history", &history, "By column of history.csv: a number per chain run.")
      .def("__getitem__", &shape, py::arg("shape"), "N by 3, mm: a shape of the calibrated model.")
      .def_readonly("warnings", &Calibration::warnings)
      .def("__repr__", [](const Calibration& self) {
        return fmt::format("<supine.Calibration of {}: RMS {:.2f} mm>", self.measured->description.name,
                           self.result.in_sample.rms_mm);
      });
  bind_arrays(bound);
}

}  // namespace

void bind_calibration(py::module_& module) {
  bind_class(module);
  module.def(
      "calibrate",
      [](const pipeline::Case& description, const Mesh& mesh, const Model& model, std::optional<std::string> method,
         std::string intervals, std::optional<double> until_mae_mm, unsigned seed, int starts, double robust_mm,
         int population, int max_evaluations, bool use_priors, bool scan_offset,
         const std::vector<py::object>& residuals, py::object progress) {
        pipeline::CalibrateOptions options;
        options.method = method.value_or("");
        options.intervals = std::move(intervals);
        options.until_mae_mm = until_mae_mm;
        options.seed = seed;
        options.starts = starts;
        options.robust_mm = robust_mm;
        options.population = population;
        options.max_evaluations = max_evaluations;
        options.use_priors = use_priors;
        options.scan_offset = scan_offset;
        return calibrate(description, mesh, model, std::move(options), residuals, std::move(progress));
      },
      py::arg("case"), py::arg("mesh"), py::arg("model"), py::kw_only(), py::arg("method") = py::none(),
      py::arg("intervals") = "linear", py::arg("until_mae_mm") = py::none(), py::arg("seed") = 1, py::arg("starts") = 1,
      py::arg("robust_mm") = 5.0, py::arg("population") = 0, py::arg("max_evaluations") = 300,
      py::arg("use_priors") = true, py::arg("scan_offset") = false, py::arg("residuals") = py::list(),
      py::arg("progress") = py::none(),
      "Fits the free numbers of the model to the measured surfaces, as supine-calibrate does.\n\n"
      "method: joint, least-squares or cmaes; None: joint, or least-squares beside an option that only it knows. "
      "residuals: supine.Residual objects that count beside the scans (least-squares).");
}

}  // namespace supine::python
