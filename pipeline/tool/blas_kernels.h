// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

namespace supine::pipeline {

/// OPENBLAS_CORETYPE that fits this processor better than the kernels of 2004 that OpenBLAS takes where it does not
/// know it; empty where what it chose is as good.
/// @param chosen  as openblas_get_corename() says
std::string fitting_blas_kernels(const std::string& chosen);

}  // namespace supine::pipeline
