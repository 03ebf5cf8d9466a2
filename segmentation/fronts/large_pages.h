// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>

namespace supine::segmentation {

/// Allocator of memory in large pages where the system has them, for arrays that are read in no order: with small pages
/// half of the time goes into finding them.
template <class T>
struct LargePages {
  using value_type = T;
  LargePages() = default;
  template <class U>
  LargePages(const LargePages<U>&) {}
  T* allocate(std::size_t count) {
    constexpr std::size_t page = std::size_t{1} << 21;
    const std::size_t bytes = (count * sizeof(T) + page - 1) / page * page;
    void* memory = std::aligned_alloc(page, bytes);
    if (memory == nullptr) throw std::bad_alloc();
    madvise(memory, bytes, MADV_HUGEPAGE);
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }
  bool operator==(const LargePages&) const { return true; }
};

/// Asks the memory for what will be read soon. GCC drops calls of functions that do nothing but prefetch, as if they
/// had no effect; the empty volatile statement keeps them.
inline void fetch_ahead(const void* place) {
  __builtin_prefetch(place);
  asm volatile("");
}

}  // namespace supine::segmentation
