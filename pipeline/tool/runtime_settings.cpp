// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/runtime_settings.h"

#include <malloc.h>
#include <omp.h>
#include <unistd.h>

#include <Eigen/Core>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "pipeline/tool/blas_kernels.h"

extern "C" char* openblas_get_corename(void);
extern "C" void openblas_set_num_threads(int threads);

namespace supine::pipeline {
namespace {

/// @return true when the variable was set now.
bool set_if_unset(const char* variable, const char* value) {
  if (std::getenv(variable) != nullptr) return false;
  return setenv(variable, value, 1) == 0;
}

bool choose_blas_kernels() {
  const std::string fitting = fitting_blas_kernels(openblas_get_corename());
  return !fitting.empty() && set_if_unset("OPENBLAS_CORETYPE", fitting.c_str());
}

bool shorten_spinning() {
  if (std::getenv("OMP_WAIT_POLICY") != nullptr) return false;
  return set_if_unset("GOMP_SPINCOUNT", "1000");
}

}  // namespace

void keep_freed_memory() {
  constexpr int never = 0, most = 1 << 30;
  mallopt(M_MMAP_MAX, never);
  mallopt(M_TRIM_THRESHOLD, most);
}

/// Parallelism is that of our own loops; BLAS on one thread keeps results identical for any thread count.
int use_threads(int wanted) {
  const int threads = wanted > 0 ? wanted : omp_get_max_threads();
  omp_set_num_threads(threads);
  Eigen::setNbThreads(1);  // its products would be cut, and rounded, by the number of threads
  openblas_set_num_threads(1);
  return threads;
}

void use_fitting_settings(char** argv) {
  const bool blas = choose_blas_kernels(), spinning = shorten_spinning();
  if (!blas && !spinning) return;
  std::error_code unknown;  // by its own path, so that it keeps its name in the list of processes
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (!unknown) execv(program.c_str(), argv);
}

}  // namespace supine::pipeline
