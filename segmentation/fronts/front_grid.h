// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include "segmentation/fronts/large_pages.h"
#include "segmentation/image.h"

namespace supine::segmentation {

/// State of a voxel while a front marches, in four bytes: passed (its time; infinity where no front may go), fresh (its
/// slowness over the least one, >= 1), or in the band beside the front (number of its record).
class FrontState {
 public:
  FrontState() = default;
  static FrontState wall() { return passed(std::numeric_limits<float>::infinity()); }
  static FrontState passed(float time) { return FrontState(std::bit_cast<std::uint32_t>(time)); }
  /// @param slowness  >= 1 and finite
  static FrontState fresh(float slowness) {
    return FrontState(fresh_bits + (std::bit_cast<std::uint32_t>(slowness) - one_bits));
  }
  static FrontState in_band(std::uint32_t record) { return FrontState(band_bits | record); }

  bool is_passed() const { return bits_ < fresh_bits; }
  bool is_fresh() const { return bits_ >= fresh_bits && bits_ < band_bits; }
  bool is_in_band() const { return bits_ >= band_bits; }
  float time() const { return std::bit_cast<float>(bits_); }
  float slowness() const { return std::bit_cast<float>(bits_ - fresh_bits + one_bits); }
  std::uint32_t record() const { return bits_ & ~band_bits; }
  /// Whether a front passed no later than then. One comparison: the other states have greater bits than every time.
  bool passed_by(float then) const { return bits_ <= std::bit_cast<std::uint32_t>(then); }

 private:
  explicit FrontState(std::uint32_t bits) : bits_(bits) {}
  static constexpr std::uint32_t one_bits = 0x3f800000, fresh_bits = 0x80000000, band_bits = 0xc0000000;
  std::uint32_t bits_ = 0x7f800000;
};

/// The states of a volume's voxels with a border of walls, ordered in bricks of 16 x 8 x 8 (a memory page) made of
/// bricks of 4 x 2 x 2 (a cache line): the front is thin, and comes to its voxels in an order that no cache foresees.
class FrontGrid {
 public:
  using Neighbours = std::array<std::uint32_t, 6>;  ///< below and above along x, y, z

  explicit FrontGrid(const Eigen::Vector3i& size);
  /// Voxels with border and filling of the last bricks.
  static double stored(const Eigen::Vector3i& size);

  std::uint32_t index(int i, int j, int k) const { return parts_[0][i + 1] + parts_[1][j + 1] + parts_[2][k + 1]; }
  /// @pre the voxel is not of the border
  Neighbours neighbours(std::uint32_t voxel) const {
    Neighbours result;
    const auto& steps = steps_[voxel % page];
    for (int side = 0; side < 6; ++side) result[side] = voxel + steps[side];
    return result;
  }
  FrontState& operator[](std::uint32_t voxel) { return states_[voxel]; }
  const FrontState& operator[](std::uint32_t voxel) const { return states_[voxel]; }

 private:
  static constexpr std::array<int, 3> brick{16, 8, 8};
  static constexpr std::uint32_t page = 1024;
  std::array<std::vector<std::uint32_t>, 3> parts_;       ///< index = sum over the axes, border first
  std::array<std::array<std::uint32_t, 8>, page> steps_;  ///< modulo 2^32; the last two are not used
  std::vector<FrontState, LargePages<FrontState>> states_;
};

}  // namespace supine::segmentation
