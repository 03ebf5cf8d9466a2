// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <numeric>

#include "segmentation/masks.h"

namespace supine::segmentation {
namespace {

/// Calls visit(neighbour) for the voxels across the faces of voxel n.
template <class Visit>
void for_face_neighbours(const Grid& grid, std::size_t n, Visit visit) {
  const auto nx = static_cast<std::size_t>(grid.size.x()), nxy = nx * grid.size.y(), count = grid.count();
  const std::size_t i = n % nx, j = n % nxy;
  if (i > 0) visit(n - 1);
  if (i + 1 < nx) visit(n + 1);
  if (j >= nx) visit(n - nx);
  if (j + nx < nxy) visit(n + nx);
  if (n >= nxy) visit(n - nxy);
  if (n + nxy < count) visit(n + nxy);
}

/// Voxels of one row, from begin up to end, that have the same value.
struct Run {
  std::size_t begin, end;
  std::uint8_t value;
};

/// The runs of a volume, joined (union-find) where they share faces and value. The root of a component is its first
/// run.
class RunForest {
 public:
  RunForest(std::span<const std::uint8_t> values, const Grid& grid) {
    const auto nx = static_cast<std::size_t>(grid.size.x()), ny = static_cast<std::size_t>(grid.size.y());
    const std::size_t rows = ny * grid.size.z();
    std::vector<std::size_t> first(rows + 1, 0);  // run at which a row begins
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t n = row * nx, last = n + nx; n < last;) {
        const std::size_t begin = n;
        while (n < last && values[n] == values[begin]) ++n;
        runs_.push_back({begin, n, values[begin]});
      }
      first[row + 1] = runs_.size();
    }
    parent_.resize(runs_.size());
    std::iota(parent_.begin(), parent_.end(), 0);
    for (std::size_t row = 0; row < rows; ++row) {
      if (row % ny > 0) join_rows(first[row - 1], first[row], first[row + 1], nx);
      if (row >= ny) join_rows(first[row - ny], first[row], first[row + 1], ny * nx);
    }
  }

  const std::vector<Run>& runs() const { return runs_; }
  std::size_t root(std::size_t run) {
    while (parent_[run] != run) run = parent_[run] = parent_[parent_[run]];
    return run;
  }

 private:
  /// Joins the runs from..to of a row with those, from `other` on, of the row that lies `offset` voxels before.
  void join_rows(std::size_t other, std::size_t from, std::size_t to, std::size_t offset) {
    for (std::size_t run = from; run < to;) {
      const std::size_t end = runs_[run].end, other_end = runs_[other].end + offset;
      if (runs_[run].value == runs_[other].value) join(run, other);
      if (end <= other_end) ++run;
      if (other_end <= end) ++other;
    }
  }
  void join(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

  std::vector<Run> runs_;
  std::vector<std::size_t> parent_;
};

bool at_edge(const Grid& grid, std::size_t n) {
  int neighbours = 0;
  for_face_neighbours(grid, n, [&neighbours](std::size_t) { ++neighbours; });
  return neighbours < 6;
}

}  // namespace

Components connected_components(const Mask& mask, const Grid& grid) {
  RunForest forest(mask, grid);
  Components result;
  result.number.assign(mask.size(), 0);
  std::vector<std::int32_t> numbers(forest.runs().size(), 0);
  for (std::size_t r = 0; r < forest.runs().size(); ++r) {
    const Run& run = forest.runs()[r];
    if (run.value == 0) continue;
    const std::size_t root = forest.root(r);
    if (root == r) {
      result.size.push_back(0);
      numbers[r] = static_cast<std::int32_t>(result.size.size());
    }
    const std::int32_t number = numbers[root];
    result.size[static_cast<std::size_t>(number - 1)] += run.end - run.begin;
    std::fill(result.number.begin() + static_cast<std::ptrdiff_t>(run.begin),
              result.number.begin() + static_cast<std::ptrdiff_t>(run.end), number);
  }
  return result;
}

std::array<std::size_t, 256> component_counts(std::span<const std::uint8_t> values, const Grid& grid) {
  RunForest forest(values, grid);
  std::array<std::size_t, 256> counts{};
  for (std::size_t r = 0; r < forest.runs().size(); ++r)
    if (forest.root(r) == r) ++counts[forest.runs()[r].value];
  return counts;
}

Mask flood(const Mask& allowed, const Grid& grid, std::span<const std::size_t> seeds) {
  Mask reached(allowed.size(), 0);
  std::vector<std::size_t> stack;
  const auto visit = [&](std::size_t n) {
    if (!allowed[n] || reached[n]) return;
    reached[n] = 1;
    stack.push_back(n);
  };
  for (const std::size_t seed : seeds) visit(seed);
  while (!stack.empty()) {
    const std::size_t n = stack.back();
    stack.pop_back();
    for_face_neighbours(grid, n, visit);
  }
  return reached;
}

Mask keep_islands(const Mask& mask, const Grid& grid, std::size_t keep, double min_voxels) {
  const Components components = connected_components(mask, grid);
  std::vector<std::size_t> order(components.size.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&components](std::size_t a, std::size_t b) { return components.size[a] > components.size[b]; });
  if (keep > 0 && order.size() > keep) order.resize(keep);
  std::vector<std::uint8_t> kept(components.size.size() + 1, 0);
  for (const std::size_t c : order) kept[c + 1] = static_cast<double>(components.size[c]) >= min_voxels;
  Mask result(mask.size());
  for (std::size_t n = 0; n < mask.size(); ++n) result[n] = kept[static_cast<std::size_t>(components.number[n])];
  return result;
}

Mask fill_holes(const Mask& mask, const Grid& grid, double max_voxels) {
  Mask outside(mask.size());
  for (std::size_t n = 0; n < mask.size(); ++n) outside[n] = !mask[n];
  const Components components = connected_components(outside, grid);
  std::vector<std::uint8_t> filled(components.size.size() + 1, 0);
  for (std::size_t c = 0; c < components.size.size(); ++c)
    filled[c + 1] = static_cast<double>(components.size[c]) <= max_voxels;
  for (std::size_t n = 0; n < mask.size(); ++n)
    if (outside[n] && at_edge(grid, n)) filled[static_cast<std::size_t>(components.number[n])] = 0;
  Mask result = mask;
  for (std::size_t n = 0; n < mask.size(); ++n)
    if (outside[n]) result[n] = filled[static_cast<std::size_t>(components.number[n])];
  return result;
}

}  // namespace supine::segmentation
