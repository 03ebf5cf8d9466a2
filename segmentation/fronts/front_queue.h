// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "segmentation/fronts/large_pages.h"

namespace supine::segmentation {

/// What falls due at times >= 0 that are never before the last one taken, in the exact order of the times; equal times
/// in an order that depends only on the calls. Buckets are runs of neighbouring float numbers, 16384 to a factor of
/// two, so that there is no width to choose; a bucket is sorted when it is opened. Entries of the present factor of two
/// lie in their buckets, later ones wait in one list per factor of two.
class FrontQueue {
 public:
  struct Entry {
    std::uint64_t key;  ///< bits of the time, then the item: floats >= 0 have the order of their bits
    std::uint32_t time_bits() const { return static_cast<std::uint32_t>(key >> 32); }
    float time() const { return std::bit_cast<float>(time_bits()); }
    std::uint32_t item() const { return static_cast<std::uint32_t>(key); }
    bool operator<(const Entry& other) const { return key < other.key; }
    bool operator>(const Entry& other) const { return key > other.key; }
  };
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  FrontQueue() : lists_(slot_count + octave_count) {}

  /// @param time  finite, >= 0
  void push(float time, std::uint32_t item);

  /// Bucket of a time, in the order of times.
  static std::uint32_t bucket(float time) { return std::bit_cast<std::uint32_t>(time) >> bucket_shift; }
  /// No later than the earliest bucket that holds something and is not open; none when there is nothing.
  std::uint32_t next_bucket();
  /// Whether all of the open bucket has been taken.
  bool used_up() const { return head_ == open_.size() && late_.empty(); }
  /// Opens the next bucket; what keep(entry) refuses is forgotten. ahead(entry) is called some entries before.
  /// @pre used_up() and next_bucket() != none
  template <class Keep, class Ahead>
  void open_next(Keep keep, Ahead ahead) {
    take_next_bucket();
    std::size_t kept = 0;
    for (std::size_t n = 0; n < open_.size(); ++n) {
      if (n + 16 < open_.size()) ahead(open_[n + 16]);
      const Entry entry = open_[n];
      open_[kept] = entry;
      kept += keep(entry) ? 1 : 0;
    }
    open_.resize(kept);
    sort_open();
  }

  /// The earliest entry of the open bucket. @pre not used_up()
  Entry earliest() const {
    if (late_.empty()) return open_[head_];
    return head_ == open_.size() ? late_.front() : std::min(open_[head_], late_.front());
  }
  void pop();
  /// What comes next in the open bucket, as far as known.
  std::span<const Entry> ahead() const { return std::span(open_).subspan(head_); }

 private:
  static constexpr int slot_bits = 14, bucket_shift = 23 - slot_bits;
  static constexpr std::uint32_t slot_count = 1u << slot_bits, octave_count = 256;
  /// Lists are chains of blocks from one store: a list that was used up leaves its memory to the next.
  struct Block {
    Entry entries[31];
    std::uint32_t next;
  };
  struct List {
    std::uint32_t block = none;
    std::uint32_t used = 0;  ///< of the first block; the others are full
  };
  void append(List& list, Entry entry) {
    if (list.block == none || list.used == std::size(Block{}.entries)) add_block(list);
    blocks_[list.block].entries[list.used++] = entry;
  }
  void add_block(List& list);
  void empty_list(List& list, std::vector<Entry>& into);
  void take_next_bucket();
  void sort_open();
  List& slot(std::uint32_t bucket) { return lists_[bucket & (slot_count - 1)]; }
  List& octave(std::uint32_t number) { return lists_[slot_count + number]; }

  std::vector<List> lists_;
  std::vector<Block, LargePages<Block>> blocks_;
  std::vector<std::uint32_t> free_blocks_;
  std::uint32_t open_bucket_ = 0, next_bucket_ = 1, octave_ = 0;
  std::size_t in_octave_ = 0;  ///< entries in the slots
  std::vector<Entry> open_, sorted_, late_;
  std::size_t head_ = 0;
};

}  // namespace supine::segmentation
