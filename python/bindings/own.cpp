// SPDX-License-Identifier: AGPL-3.0-or-later
#include "python/bindings/own.h"

#include <fmt/core.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "python/bindings/arrays.h"
#include "python/bindings/errors.h"
#include "simulation/catalogue.h"
#include "simulation/fields.h"

namespace supine::python {

namespace py = pybind11;
using simulation::Dual;
using simulation::Fields;

namespace {

/// What an effect may look at; empty once its call is over.
struct Scene {
  const simulation::Scene* scene;

  const simulation::Scene& open() const {
    if (scene == nullptr) throw InputError("a scene is there only while its effect is asked; copy what you keep of it");
    return *scene;
  }
};

template <class Of>
auto array_of(Of of) {
  return [of](const Scene& self) { return copy_of(std::decay_t<decltype(of(self.open()))>(of(self.open()))); };
}

/// The column an effect names, and whether it adds to its logarithm.
struct Change {
  Fields<Dual>::Column Fields<Dual>::*column;
  bool of_logarithm;
};

Change change_of(const std::string& effect, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& field : simulation::field_columns<Dual>) {
    if (name == field.name) return {field.column, false};
    if (name == std::string("ln_") + field.name) return {field.column, true};
    names.push_back(field.name);
  }
  std::string all;
  for (const std::string& one : names) all += (all.empty() ? "" : ", ") + one;
  throw InputError(fmt::format("effect {}: there is no field {}; there are {}, and ln_ before each for its logarithm",
                               effect, name, all));
}

/// An entry of the catalogue that is written in Python.
class PythonEffect : public simulation::Effect {
 public:
  explicit PythonEffect(py::object object) { replace(std::move(object)); }

  void replace(py::object object) {
    std::vector<simulation::Parameter> rows;
    for (const py::handle& row : object.attr("parameters")) rows.push_back(row.cast<simulation::Parameter>());
    name_ = object.attr("name").cast<std::string>();
    meaning_ = object.attr("meaning").cast<std::string>();
    traits_.kind = kind_of(object.attr("kind").cast<std::string>());
    traits_.acts_in = acts_in_of(object.attr("acts_in").cast<std::string>());
    rows_ = std::move(rows);
    object_ = object.release();  // as long as the program, whose catalogue it is in
  }

  std::string name() const override { return name_; }
  std::string meaning() const override { return meaning_; }
  const std::vector<simulation::Parameter>& parameters() const override { return rows_; }
  simulation::EffectTraits traits() const override { return traits_; }

  void apply(const simulation::Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
             Fields<Dual>& fields) const override {
    in_python([&] {
      py::object open = py::cast(Scene{&scene});
      try {
        change(open, values, fields);
      } catch (...) {
        open.cast<Scene&>().scene = nullptr;
        throw;
      }
      open.cast<Scene&>().scene = nullptr;
    });
  }

 private:
  simulation::EffectKind kind_of(const std::string& kind) const {
    if (kind == "tissue") return simulation::EffectKind::tissue;
    if (kind == "boundary") return simulation::EffectKind::boundary;
    throw InputError(fmt::format("effect {}: kind = {}: must be tissue or boundary", name_, kind));
  }
  simulation::ActsIn acts_in_of(const std::string& where) const {
    if (where == "every_pose") return simulation::ActsIn::every_pose;
    if (where == "all_but_imaged") return simulation::ActsIn::all_but_imaged;
    if (where == "imaged_only") return simulation::ActsIn::imaged_only;
    throw InputError(
        fmt::format("effect {}: acts_in = {}: must be every_pose, all_but_imaged or imaged_only", name_, where));
  }

  void change(const py::object& scene, std::span<const Dual> values, Fields<Dual>& fields) const {
    py::dict by_name;
    for (std::size_t p = 0; p < rows_.size(); ++p) by_name[py::str(rows_[p].name)] = values[p].a;
    // supine/own.py asks the effect, and checks its derivatives the first time it sees a mesh and a pose.
    const py::tuple answer = object_.attr("_changes")(scene, by_name);
    const auto slopes = answer[1].cast<py::dict>();
    for (const auto& [key, array] : answer[0].cast<py::dict>()) {
      const std::string field = key.cast<std::string>();
      const Eigen::VectorXd values_of_field = column(array, field, fields);
      Eigen::VectorXd slope = Eigen::VectorXd::Zero(values_of_field.size());
      for (std::size_t p = 0; p < rows_.size(); ++p)
        if (values[p].v[0] != 0) slope += values[p].v[0] * column(slopes[py::str(rows_[p].name)][key], field, fields);
      add(change_of(name_, field), values_of_field, slope, fields);
    }
  }

  Eigen::VectorXd column(const py::handle& array, const std::string& field, const Fields<Dual>& fields) const {
    const auto numbers = array.cast<DoubleArray>();
    const Eigen::Index size = (fields.*change_of(name_, field).column).size();
    if (numbers.ndim() == 0) return Eigen::VectorXd::Constant(size, *numbers.data());
    if (numbers.size() != size)
      throw InputError(fmt::format("effect {}: {} numbers for {}, which has {}", name_, numbers.size(), field, size));
    Eigen::VectorXd found = Eigen::Map<const Eigen::VectorXd>(numbers.data(), size);
    if (!found.allFinite())
      throw InputError(fmt::format("effect {}: {} holds a number that is not finite", name_, field));
    return found;
  }

  static void add(const Change& change, const Eigen::VectorXd& values, const Eigen::VectorXd& slope,
                  Fields<Dual>& fields) {
    auto& column = fields.*change.column;
    for (Eigen::Index i = 0; i < column.size(); ++i) {
      if (values[i] == 0 && slope[i] == 0) continue;  // at null nothing changes, bit for bit
      Dual more(values[i]);
      more.v[0] = slope[i];
      if (change.of_logarithm)
        column[i] *= ceres::exp(more);
      else
        column[i] += more;
    }
  }

  py::handle object_;
  std::string name_, meaning_;
  simulation::EffectTraits traits_;
  std::vector<simulation::Parameter> rows_;
};

/// Adds it, or puts it in the place of an earlier one of Python: cells of a notebook are run again.
void add_effect(const py::object& object) {
  static std::map<std::string, PythonEffect*> own;
  const auto name = object.attr("name").cast<std::string>();
  if (const auto known = own.find(name); known != own.end()) return known->second->replace(object);
  auto effect = std::make_unique<PythonEffect>(object);
  simulation::add_to_catalogue(*effect);
  own[name] = effect.release();
}

simulation::Parameter make_parameter(std::string name, std::string unit, double null, double lower, double upper,
                                     double median, double spread, bool one_sided, std::string meaning, bool shape) {
  const auto refuse = [&name](const std::string& why) { throw InputError(fmt::format("parameter {}: {}", name, why)); };
  if (name.empty() || name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
    refuse("its name must be small letters, digits and _");
  for (const double number : {null, lower, upper, median, spread})
    if (!std::isfinite(number)) refuse("its numbers must be finite");
  if (!(lower < upper)) refuse(fmt::format("lower = {} must be below upper = {}", lower, upper));
  if (!(null >= lower && null <= upper)) refuse(fmt::format("null = {} must be {} to {}", null, lower, upper));
  if (!(median >= lower && median <= upper)) refuse(fmt::format("median = {} must be {} to {}", median, lower, upper));
  if (!(spread > 0)) refuse(fmt::format("spread = {}: must be > 0", spread));
  return {std::move(name), std::move(unit), null, lower, upper, median, spread, one_sided, std::move(meaning), shape};
}

/// Shapes and moves of a solution by name, as Python sees them.
py::dict by_name(const std::vector<std::string>& names, const Points& prone, const Points& undeformed,
                 const std::vector<const Points*>& poses) {
  py::dict shapes;
  shapes["imaged"] = copy_of(prone);
  shapes["undeformed"] = copy_of(undeformed);
  for (std::size_t p = 0; p < poses.size(); ++p) shapes[py::str(names[p])] = copy_of(*poses[p]);
  return shapes;
}

py::dict shapes_of(const simulation::ChainSolution& solution) {
  std::vector<std::string> names;
  std::vector<const Points*> poses;
  for (const auto& pose : solution.poses) names.push_back(pose.name), poses.push_back(&pose.x);
  return by_name(names, solution.prone, solution.X, poses);
}

py::dict moves_of(const simulation::ChainSolution& solution, const simulation::ChainDerivative& move) {
  std::vector<std::string> names;
  std::vector<const Points*> poses;
  for (std::size_t p = 0; p < move.poses.size(); ++p)
    names.push_back(solution.poses[p].name), poses.push_back(&move.poses[p]);
  return by_name(names, move.prone, move.X, poses);
}

Eigen::VectorXd rows_of(const py::object& answer, const std::string& name) {
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(answer);
  if (!numbers) {
    PyErr_Clear();
    throw InputError(fmt::format("residual {}: must give an array of numbers", name));
  }
  Eigen::VectorXd rows = Eigen::Map<const Eigen::VectorXd>(numbers.data(), numbers.size());
  if (!rows.allFinite()) throw InputError(fmt::format("residual {}: gives a number that is not finite", name));
  return rows;
}

void bind_parameter(py::module_& module) {
  using simulation::Parameter;
  py::class_<Parameter>(module, "Parameter", "A number of an effect of one's own: its unit, range and prior.")
      .def(
          py::init(&make_parameter), py::arg("name"), py::kw_only(), py::arg("unit") = "1", py::arg("null") = 0.0,
          py::arg("lower"), py::arg("upper"), py::arg("median") = 0.0, py::arg("spread"), py::arg("one_sided") = false,
          py::arg("meaning") = "", py::arg("shape") = false,
          "null: where the effect leaves the model as it is. median, spread: the prior; of one-sided numbers spread is "
          "the standard deviation of the logarithm.")
      .def_readonly("name", &Parameter::name)
      .def_readonly("unit", &Parameter::unit)
      .def_readonly("null", &Parameter::null)
      .def_readonly("lower", &Parameter::lower)
      .def_readonly("upper", &Parameter::upper)
      .def_readonly("median", &Parameter::median);
}

void bind_scene(py::module_& module) {
  using Look = const simulation::Scene&;
  py::class_<Scene>(module, "Scene",
                    "What an effect may look at while it is asked. C cells, S skin faces, I points of "
                    "the interface.")
      .def_property_readonly("pose", [](const Scene& self) { return self.open().pose; })
      .def_property_readonly("is_imaged", [](const Scene& self) { return self.open().is_imaged(); })
      .def_property_readonly("points", array_of([](Look s) -> const Points& { return s.mesh.points; }),
                             "N by 3, mm: the nodes as imaged.")
      .def_property_readonly("cells", array_of([](Look s) -> const Indices& { return s.mesh.cells; }), "C by 4 or 10.")
      .def_property_readonly("tissue", array_of([](Look s) -> const Eigen::VectorXi& { return s.mesh.tissue; }), "C.")
      .def_property_readonly("cell_q", array_of([](Look s) -> const Table& { return s.layout.cell_q; }),
                             "C by 2: (lateral, head) in radii of the breast's foot.")
      .def_property_readonly("skin_q", array_of([](Look s) -> const Table& { return s.layout.skin.q; }), "S by 2.")
      .def_property_readonly("skin_faces",
                             array_of([](Look s) -> const Eigen::VectorXi& { return s.layout.skin.faces; }),
                             "S: rows of Mesh.faces.")
      .def_property_readonly("interface_q", array_of([](Look s) -> const Table& { return s.layout.interface.q; }),
                             "I by 2.")
      .def(
          "fraction",
          [](const Scene& self, const std::string& tissue) {
            for (int t = 0; t < segmentation::tissue_count; ++t)
              if (tissue == segmentation::tissue_names[t])
                return copy_of(Eigen::VectorXd(self.open().mesh.fraction.col(t)));
            throw InputError(fmt::format("there is no tissue {}", tissue));
          },
          py::arg("tissue"), "C: the share of a tissue in every cell.");
}

}  // namespace

PythonResidual::PythonResidual(py::object object) : object_(std::move(object)) {
  name_ = py::str(py::getattr(object_, "name", py::str(py::type::of(object_).attr("__name__"))));
  for (const char* method : {"value", "derivative"})
    if (!py::hasattr(object_, method))
      throw InputError(fmt::format("residual {}: has no method {}(); see supine.Residual", name_, method));
}

Eigen::VectorXd PythonResidual::value(const simulation::ChainSolution& shapes) const {
  return in_python([&] { return rows_of(object_.attr("value")(shapes_of(shapes)), name_); });
}

Eigen::VectorXd PythonResidual::change(const simulation::ChainSolution& shapes,
                                       const simulation::ChainDerivative& move) const {
  return in_python(
      [&] { return rows_of(object_.attr("derivative")(shapes_of(shapes), moves_of(shapes, move)), name_); });
}

void PythonResidual::check_derivative(const simulation::ChainSolution& shapes) const {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> mm(-1, 1);
  const auto random = [&](const Points& like) {
    Points move(like.rows(), 3);
    for (Eigen::Index i = 0; i < move.size(); ++i) move.data()[i] = mm(generator);
    return move;
  };
  simulation::ChainDerivative move{random(shapes.prone), random(shapes.X), {}};
  for (const auto& pose : shapes.poses) move.poses.push_back(random(pose.x));
  const auto moved = [&](double step) {
    simulation::ChainSolution to = shapes;
    to.prone += step * move.prone;
    to.X += step * move.X;
    for (std::size_t p = 0; p < to.poses.size(); ++p) to.poses[p].x += step * move.poses[p];
    return value(to);
  };
  in_python([&] {
    const auto f = py::cpp_function([&](double step) { return copy_of(moved(step)); });
    py::module_::import("supine.own").attr("check_derivative")("residual " + name_, f, copy_of(change(shapes, move)));
  });
}

void bind_own(py::module_& module) {
  bind_parameter(module);
  bind_scene(module);
  module.def("_add_effect", &add_effect, py::arg("effect"));
}

}  // namespace supine::python
