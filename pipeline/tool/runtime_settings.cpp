// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/runtime_settings.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

extern "C" char* openblas_get_corename(void);

namespace supine::pipeline {
namespace {

/// @return true when the variable was set now.
bool set_if_unset(const char* variable, const char* value) {
  if (std::getenv(variable) != nullptr) return false;
  return setenv(variable, value, 1) == 0;
}

bool choose_blas_kernels() {
#if defined(__x86_64__)
  const std::string chosen = openblas_get_corename();
  if (chosen != "Prescott" && chosen != "Core2" && chosen != "Generic" && chosen != "Nehalem") return false;
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return false;
  const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                    __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  return set_if_unset("OPENBLAS_CORETYPE", wide ? "SkylakeX" : "Haswell");
#else
  return false;
#endif
}

bool shorten_spinning() {
  if (std::getenv("OMP_WAIT_POLICY") != nullptr) return false;
  return set_if_unset("GOMP_SPINCOUNT", "1000");
}

}  // namespace

void use_fitting_settings(char** argv) {
  const bool blas = choose_blas_kernels(), spinning = shorten_spinning();
  if (!blas && !spinning) return;
  std::error_code unknown;  // by its own path, so that it keeps its name in the list of processes
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (!unknown) execv(program.c_str(), argv);
}

}  // namespace supine::pipeline
