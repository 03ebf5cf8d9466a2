// SPDX-License-Identifier: AGPL-3.0-or-later
#include "python/bindings/engine_run.h"

#include <omp.h>

namespace supine::python {

namespace py = pybind11;

EngineRun::EngineRun(const std::string& tool, py::object progress)
    : progress_(std::move(progress)),
      run_(tool, false, true, false, omp_get_max_threads(), nlohmann::ordered_json::object()) {
  if (!progress_.is_none() && PyCallable_Check(progress_.ptr()) == 0)
    throw py::type_error("progress must be a function that takes a line of text, or None");
  run_.listen([this](pipeline::Said kind, const std::string& line) { hear(kind, line); });
}

void EngineRun::hear(pipeline::Said kind, const std::string& line) {
  in_python([&] {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();  // Ctrl-C
    if (kind == pipeline::Said::warning)
      warnings_.push_back(line);
    else if (!progress_.is_none())
      progress_(line);
  });
}

}  // namespace supine::python
