// SPDX-License-Identifier: AGPL-3.0-or-later
#include "python/bindings/errors.h"

#include <filesystem>

#include "common/error.h"

namespace supine::python {

namespace py = pybind11;

namespace {

// Alive as long as the interpreter: it is called when the module may be gone already.
PyObject *error_class, *input_error_class, *numerical_failure_class, *warning_class;

PyObject* make_class(py::module_& module, const char* name, const py::tuple& bases, const char* doc) {
  const std::string full = std::string("supine.") + name;
  PyObject* made = PyErr_NewExceptionWithDoc(full.c_str(), doc, bases.ptr(), nullptr);
  if (made == nullptr) throw py::error_already_set();
  module.attr(name) = py::handle(made);
  return made;
}

void translate(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(std::move(thrown));
  } catch (const RaisedInPython& raised) {
    raised.error->restore();
  } catch (const InputError& error) {
    PyErr_SetString(input_error_class, error.what());
  } catch (const NumericalFailure& error) {
    PyErr_SetString(numerical_failure_class, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    PyErr_SetString(input_error_class, (error.path1().string() + ": " + error.code().message()).c_str());
  }
}

}  // namespace

void bind_errors(py::module_& module) {
  const auto class_of = [](PyObject* known) { return py::reinterpret_borrow<py::object>(known); };
  error_class = make_class(module, "Error", py::make_tuple(class_of(PyExc_Exception)),
                           "What supine raises; its message is that of the tools.");
  input_error_class =
      make_class(module, "InputError", py::make_tuple(class_of(error_class), class_of(PyExc_ValueError)),
                 "A file, key, value or place is at fault: what, where, the value, the bound and what to do. "
                 "The tools end with exit code 2.");
  numerical_failure_class =
      make_class(module, "NumericalFailure", py::make_tuple(class_of(error_class), class_of(PyExc_ArithmeticError)),
                 "The input is valid and there is no solution: no equilibrium, an inverted element. The tools end with "
                 "exit code 3.");
  warning_class =
      make_class(module, "SupineWarning", py::make_tuple(class_of(PyExc_UserWarning)), "A caution of the tools.");
  py::register_exception_translator(&translate);
}

void warn_in_python(const std::string& line) {
  if (PyErr_WarnEx(warning_class, line.c_str(), 1) != 0) throw py::error_already_set();
}

}  // namespace supine::python
