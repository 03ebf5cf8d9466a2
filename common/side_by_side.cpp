// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/side_by_side.h"

#include <omp.h>

#include <exception>

namespace supine {
namespace {

void do_all(const std::vector<std::function<void()>>& works, std::vector<std::exception_ptr>& failures) {
  const auto attempt = [&works, &failures](std::size_t i) noexcept {
    try {
      works[i]();
    } catch (...) {
      failures[i] = std::current_exception();
    }
  };
  for (std::size_t i = 1; i < works.size(); ++i)
#pragma omp task firstprivate(i) shared(attempt)
    attempt(i);
  attempt(0);
#pragma omp taskwait
}

}  // namespace

void side_by_side(const std::vector<std::function<void()>>& works) {
  if (works.empty()) return;
  if (works.size() == 1) return works[0]();  // its own loops have all threads
  std::vector<std::exception_ptr> failures(works.size());
  if (omp_in_parallel()) {
    do_all(works, failures);
  } else {
#pragma omp parallel
#pragma omp single
    do_all(works, failures);
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

}  // namespace supine
