// SPDX-License-Identifier: AGPL-3.0-or-later
// A module of its own, without the engine: it says what to set before the engine, and with it OpenBLAS, is loaded.
#include <pybind11/pybind11.h>

#include "pipeline/tool/blas_kernels.h"

PYBIND11_MODULE(_settings, module) {
  module.def("fitting_blas_kernels", &supine::pipeline::fitting_blas_kernels, pybind11::arg("chosen"));
}
