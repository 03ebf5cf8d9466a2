// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/fronts/front_queue.h"

#include <array>
#include <functional>

namespace supine::segmentation {

void FrontQueue::push(float time, std::uint32_t item) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(time), bucket = bits >> bucket_shift;
  const Entry entry{static_cast<std::uint64_t>(bits) << 32 | item};
  if (bucket <= open_bucket_) {
    late_.push_back(entry);
    std::push_heap(late_.begin(), late_.end(), std::greater<>());
  } else if (bits >> 23 == octave_) {
    append(slot(bucket), entry);
    next_bucket_ = std::min(next_bucket_, bucket);
    ++in_octave_;
  } else {
    append(octave(bits >> 23), entry);
  }
}

void FrontQueue::pop() {
  if (late_.empty() || (head_ < open_.size() && open_[head_] < late_.front())) {
    ++head_;
  } else {
    std::pop_heap(late_.begin(), late_.end(), std::greater<>());
    late_.pop_back();
  }
}

std::uint32_t FrontQueue::next_bucket() {
  if (in_octave_ > 0) {
    while (slot(next_bucket_).block == none) ++next_bucket_;
    return next_bucket_;
  }
  for (std::uint32_t number = octave_ + 1; number < octave_count; ++number)
    if (octave(number).block != none) return number << slot_bits;
  return none;
}

void FrontQueue::take_next_bucket() {
  next_bucket_ = next_bucket();
  if (in_octave_ == 0) {
    octave_ = next_bucket_ >> slot_bits;
    std::vector<Entry> waiting;
    empty_list(octave(octave_), waiting);
    for (const Entry& entry : waiting) append(slot(bucket(entry.time())), entry);
    in_octave_ = waiting.size();
  }
  open_bucket_ = next_bucket();
  next_bucket_ = open_bucket_ + 1;
  open_.clear();
  head_ = 0;
  empty_list(slot(open_bucket_), open_);
  in_octave_ -= open_.size();
}

void FrontQueue::add_block(List& list) {
  std::uint32_t block = static_cast<std::uint32_t>(blocks_.size());
  if (free_blocks_.empty()) {
    blocks_.emplace_back();
  } else {
    block = free_blocks_.back();
    free_blocks_.pop_back();
  }
  blocks_[block].next = list.block;
  list = {block, 0};
}

void FrontQueue::empty_list(List& list, std::vector<Entry>& into) {
  while (list.block != none) {
    const Block& block = blocks_[list.block];
    into.insert(into.end(), block.entries, block.entries + list.used);
    free_blocks_.push_back(list.block);
    list = {block.next, static_cast<std::uint32_t>(std::size(block.entries))};
  }
}

void FrontQueue::sort_open() {
  if (open_.size() < 256) {
    std::sort(open_.begin(), open_.end());
    return;
  }
  // All share the upper bits of their times: counting the lower ones sorts them.
  constexpr std::uint32_t low = (1u << bucket_shift) - 1;
  std::array<std::uint32_t, low + 2> first{};
  for (const Entry& entry : open_) ++first[(entry.time_bits() & low) + 1];
  for (std::uint32_t n = 1; n <= low; ++n) first[n] += first[n - 1];
  sorted_.resize(open_.size());
  for (const Entry& entry : open_) sorted_[first[entry.time_bits() & low]++] = entry;
  open_.swap(sorted_);
}

}  // namespace supine::segmentation
