// SPDX-License-Identifier: AGPL-3.0-or-later
#include <pybind11/pybind11.h>

#include "common/error.h"
#include "pipeline/tool/provenance.h"
#include "pipeline/tool/runtime_settings.h"
#include "python/bindings/errors.h"
#include "python/bindings/objects.h"
#include "python/bindings/own.h"

namespace py = pybind11;

PYBIND11_MODULE(_supine, module) {
  using namespace supine::python;
  static const int all = supine::pipeline::use_threads(0);
  module.attr("__version__") = std::string(supine::pipeline::supine_version());
  module.def(
      "set_threads",
      [](int threads) {
        if (threads < 0 || threads > 1024)
          throw supine::InputError("threads = " + std::to_string(threads) + ": must be 0 to 1024");
        return supine::pipeline::use_threads(threads > 0 ? threads : all);
      },
      py::arg("threads") = 0, "Threads that the engine uses, 0 = all; changes no result. Gives back their number.");
  bind_errors(module);
  bind_case(module);
  bind_mesh(module);
  bind_model(module);
  bind_simulation(module);
  bind_own(module);
  bind_calibration(module);
  bind_sensitivities(module);
  bind_diagnosis(module);
}
