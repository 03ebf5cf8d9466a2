// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/fronts/front_grid.h"

namespace supine::segmentation {
namespace {

/// Bits of a place along an axis of the brick of 16 x 8 x 8: the line's first, then those of the bricks between.
std::uint32_t within_page(int axis, int place) {
  const std::uint32_t n = static_cast<std::uint32_t>(place);
  if (axis == 0) return (n & 3) | (n >> 2 & 1) << 4 | n >> 3 << 7;
  return (n & 1) << (axis + 1) | (n >> 1 & 1) << (axis + 4) | n >> 2 << (axis + 7);
}

}  // namespace

FrontGrid::FrontGrid(const Eigen::Vector3i& size) {
  std::uint32_t stride = page;
  std::array<std::uint32_t, 3> strides;
  for (int a = 0; a < 3; ++a) {
    const int bricks = (size[a] + 2 + brick[a] - 1) / brick[a];
    strides[a] = stride;
    for (int n = 0; n < bricks * brick[a]; ++n)
      parts_[a].push_back(static_cast<std::uint32_t>(n / brick[a]) * stride + within_page(a, n % brick[a]));
    stride *= static_cast<std::uint32_t>(bricks);
  }
  for (int z = 0; z < brick[2]; ++z)
    for (int y = 0; y < brick[1]; ++y)
      for (int x = 0; x < brick[0]; ++x) {
        const std::array<int, 3> at{x, y, z};
        auto& steps = steps_[parts_[0][x] + parts_[1][y] + parts_[2][z]];
        steps.fill(0);
        for (int a = 0; a < 3; ++a)
          for (const int way : {-1, 1}) {
            const int to = at[a] + way;
            const std::uint32_t page_step = to < 0 ? 0 - strides[a] : to >= brick[a] ? strides[a] : 0;
            steps[2 * a + (way > 0)] = page_step + within_page(a, (to + brick[a]) % brick[a]) - within_page(a, at[a]);
          }
      }
  states_.resize(static_cast<std::size_t>(stored(size)), FrontState::wall());
}

double FrontGrid::stored(const Eigen::Vector3i& size) {
  double count = page;
  for (int a = 0; a < 3; ++a) count *= (size[a] + 2 + brick[a] - 1) / brick[a];
  return count;
}

}  // namespace supine::segmentation
