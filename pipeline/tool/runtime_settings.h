// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine::pipeline {

/// Starts the program again with two settings that its libraries read from the environment when they are loaded, and
/// never afterwards. A variable the user has set is left alone; returns when nothing is to be done.
///
/// OPENBLAS_CORETYPE, when OpenBLAS did not recognise the processor: on processors newer than itself, and on many
/// virtual machines, it falls back to the kernels of 2004, which makes factorisations about twice as slow.
///
/// GOMP_SPINCOUNT: a thread that waits for others burns its core for milliseconds by default. Two programs on one
/// machine then hold each other up, measured: more than ten times. A thousand turns (microseconds) cost nothing alone.
void use_fitting_settings(char** argv);

/// Has freed memory kept for the next request: factors of many megabytes come and go with every Newton step, and pages
/// that the system hands out anew have to be cleared first. Costs a quarter more memory, saves a fifth of a diagnosis.
void keep_freed_memory();

/// Has the loops of the libraries run on that many threads, 0 = all, and BLAS on one. @return  the number
int use_threads(int wanted);

}  // namespace supine::pipeline
