// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/blas_kernels.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

extern "C" char* openblas_get_corename(void);

namespace supine::pipeline {

void use_fitting_blas_kernels(char** argv) {
#if defined(__x86_64__)
  constexpr char variable[] = "OPENBLAS_CORETYPE";
  if (std::getenv(variable) != nullptr) return;
  const std::string chosen = openblas_get_corename();
  if (chosen != "Prescott" && chosen != "Core2" && chosen != "Generic" && chosen != "Nehalem") return;
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return;
  const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                    __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  setenv(variable, wide ? "SkylakeX" : "Haswell", 1);
  std::error_code unknown;  // by its own path, so that it keeps its name in the list of processes
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (!unknown) execv(program.c_str(), argv);
#else
  (void)argv;
#endif
}

}  // namespace supine::pipeline
