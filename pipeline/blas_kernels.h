// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine::pipeline {

/// Starts the program again with OPENBLAS_CORETYPE set when OpenBLAS did not recognise the processor.
///
/// OpenBLAS picks its kernels when it is loaded; on processors newer than itself, and on many virtual machines, it
/// falls back to those of 2004, which makes factorisations about twice as slow. The only remedy it offers is that
/// environment variable. Returns when nothing is to be done: the kernels fit, the processor has no AVX2, or the
/// user has set the variable.
void use_fitting_blas_kernels(char** argv);

}  // namespace supine::pipeline
