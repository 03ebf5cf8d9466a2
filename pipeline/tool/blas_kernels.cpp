// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/blas_kernels.h"

namespace supine::pipeline {

std::string fitting_blas_kernels([[maybe_unused]] const std::string& chosen) {
#if defined(__x86_64__)
  if (chosen != "Prescott" && chosen != "Core2" && chosen != "Generic" && chosen != "Nehalem") return {};
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return {};
  const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                    __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  return wide ? "SkylakeX" : "Haswell";
#else
  return {};
#endif
}

}  // namespace supine::pipeline
