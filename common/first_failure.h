// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <atomic>
#include <exception>
#include <mutex>

namespace supine {

/// Carries the first exception out of a parallel loop, which none may leave by itself: the program would end.
class FirstFailure {
 public:
  /// Calls @p work unless something has failed before. Threads may call it at the same time.
  template <class Work>
  void guard(Work work) noexcept {
    if (failed_) return;
    try {
      work();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      failed_ = true;
    }
  }

  /// To be called after the loop.
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::atomic<bool> failed_ = false;
  std::mutex mutex_;
  std::exception_ptr failure_;
};

}  // namespace supine
