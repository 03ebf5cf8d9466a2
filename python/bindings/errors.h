// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

namespace supine::python {

/// What a Python function raised, on its way through the engine. No std::exception: nothing there takes it for a
/// failure of its own.
struct RaisedInPython {
  std::shared_ptr<pybind11::error_already_set> error;
};

/// Calls Python from the engine, by any thread, and carries out what it raises.
template <class Work>
auto in_python(Work work) {
  const pybind11::gil_scoped_acquire hold;
  try {
    return work();
  } catch (pybind11::error_already_set& error) {
    throw RaisedInPython{std::make_shared<pybind11::error_already_set>(std::move(error))};
  }
}

/// supine.Error, InputError, NumericalFailure and SupineWarning; what the libraries throw becomes one of them.
void bind_errors(pybind11::module_& module);

/// warnings.warn(line, SupineWarning).
void warn_in_python(const std::string& line);

}  // namespace supine::python
