// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/moved_fat.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "segmentation/gland/fat_shift.h"

namespace supine::segmentation {
namespace {

constexpr double farthest_mm = 2.5, step_voxels = 0.25;
// Shifts by more voxels are told from noise by their own freedom alone; where voxels are finer some are taken together.
constexpr double farthest_voxels = 1.75, usual_voxel_mm = 1.4;
constexpr int lobes = 3;              // of the windowed sine that reads between voxels
constexpr int rough = 25, fine = 40;  // steps of the projected gradient
constexpr std::size_t fewest = 1000, most_looked_at = 200'000;

/// The thicker of the other two axes; the last of two alike.
int across_slices(const Grid& grid, int axis) {
  const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
  return grid.spacing_mm[a] > grid.spacing_mm[b] ? a : b;
}

int voxels_together(double spacing_mm) {
  return std::max(1, static_cast<int>(std::lround(usual_voxel_mm / spacing_mm)));
}

/// Zeros between lines: more than a shift and what reads between voxels, of some together.
int margin_of(double spacing_mm) {
  const int together = voxels_together(spacing_mm);
  return std::max(together * (static_cast<int>(std::ceil(farthest_voxels)) + lobes + 2),
                  static_cast<int>(std::ceil(farthest_mm / spacing_mm)) + lobes + 1);
}

/// Lines of voxels along one axis, from the first to the last that is known, behind one another, far enough apart that
/// no shift leads from one to the next.
struct Lines {
  std::vector<float> contrast, known;  ///< known: 1 or 0
  std::vector<std::size_t> voxel;      ///< of the grid; where known is 1
};

Lines lines_of(const std::vector<float>& contrast, const Mask& within, const Grid& grid, int axis,
               const std::vector<int>& slices, int across) {
  Lines lines;
  const auto margin = static_cast<std::size_t>(margin_of(grid.spacing_mm[axis]));
  const auto pad = [&lines, margin] {
    lines.contrast.insert(lines.contrast.end(), margin, 0);
    lines.known.insert(lines.known.end(), margin, 0);
    lines.voxel.insert(lines.voxel.end(), margin, 0);
  };
  const int third = 3 - axis - across;
  pad();
  for (const int slice : slices)
    for (int b = 0; b < grid.size[third]; ++b) {
      Eigen::Vector3i index;
      index[across] = slice;
      index[third] = b;
      const auto voxel = [&](int a) {
        index[axis] = a;
        return grid.index(index.x(), index.y(), index.z());
      };
      int begin = 0, end = grid.size[axis];
      while (begin < end && !within[voxel(begin)]) ++begin;
      while (begin < end && !within[voxel(end - 1)]) --end;
      for (int a = begin; a < end; ++a) {
        const std::size_t n = voxel(a);
        lines.contrast.push_back(within[n] ? contrast[n] : 0);
        lines.known.push_back(within[n] ? 1 : 0);
        lines.voxel.push_back(n);
      }
      if (begin < end) pad();
    }
  return lines;
}

double windowed_sine(double x) {
  if (std::abs(x) >= lobes) return 0;
  if (std::abs(x) < 1e-9) return 1;
  const double t = std::numbers::pi * x;
  return std::sin(t) / t * std::sin(t / lobes) / (t / lobes);
}

/// f to f(x - shift) - w f(x), along lines.
class Mixing {
 public:
  Mixing(double shift_voxels, double w) : largest_(std::pow(1.1 + w, 2)) {
    const int first = static_cast<int>(std::floor(shift_voxels)) - lobes + 1;
    std::map<int, double> taps;
    double sum = 0;
    for (int k = first; k < first + 2 * lobes; ++k) sum += taps[k] = windowed_sine(shift_voxels - k);
    for (auto& [k, weight] : taps) weight /= sum;
    taps[0] -= w;
    taps_.assign(taps.begin(), taps.end());
  }

  double largest() const { return largest_; }  ///< no less than the square of its norm

  /// @param sign  1: as it is; -1: its transpose
  void apply(const std::vector<float>& f, int sign, std::vector<float>& out) const {
    const auto size = static_cast<std::ptrdiff_t>(f.size());
    std::fill(out.begin(), out.end(), 0.0F);
    for (const auto& [k, weight] : taps_) {
      const std::ptrdiff_t from = -sign * k;
      const auto w = static_cast<float>(weight);
      const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(0, -from), end = std::min(size, size - from);
      for (std::ptrdiff_t n = begin; n < end; ++n) out[n] += w * f[n + from];
    }
  }

 private:
  std::vector<std::pair<int, double>> taps_;
  double largest_;
};

struct Unmixed {
  std::vector<float> share;
  double left;  ///< root mean square of what it does not explain
};

Unmixed unmix(const Lines& lines, const Mixing& mixing, int steps) {
  const std::size_t size = lines.contrast.size();
  std::vector<float> f(size, 0), ahead(size, 0), misfit(size), slope(size);
  const auto rest = [&](const std::vector<float>& of) {
    mixing.apply(of, 1, misfit);
    for (std::size_t n = 0; n < size; ++n) misfit[n] = (misfit[n] - lines.contrast[n]) * lines.known[n];
  };
  const auto rate = static_cast<float>(1 / mixing.largest());
  double momentum = 1;
  for (int step = 0; step < steps; ++step) {
    rest(ahead);
    mixing.apply(misfit, -1, slope);
    const double next = (1 + std::sqrt(1 + 4 * momentum * momentum)) / 2;
    const auto further = static_cast<float>((momentum - 1) / next);
    for (std::size_t n = 0; n < size; ++n) {
      const float now = std::clamp(ahead[n] - rate * slope[n], 0.0F, 1.0F) * lines.known[n];
      ahead[n] = now + further * (now - f[n]);
      f[n] = now;
    }
    momentum = next;
  }
  rest(f);
  const double square = std::inner_product(misfit.begin(), misfit.end(), misfit.begin(), 0.0);
  const double count = std::accumulate(lines.known.begin(), lines.known.end(), 0.0);
  return {std::move(f), std::sqrt(square / count)};
}

/// Slices with the most gland, together no more than some voxels.
std::vector<int> slices_to_look_at(const std::vector<float>& contrast, const Mask& within, const Grid& grid, int across,
                                   double pure) {
  const int count = grid.size[across];
  std::vector<std::size_t> gland(static_cast<std::size_t>(count), 0), all = gland;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        if (!within[n]) continue;
        const auto slice = static_cast<std::size_t>(Eigen::Vector3i(i, j, k)[across]);
        ++all[slice];
        gland[slice] += contrast[n] > 0.5 * pure;
      }
  std::vector<int> order(static_cast<std::size_t>(count)), taken;
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&gland](int a, int b) { return gland[a] > gland[b]; });
  std::size_t voxels = 0;
  for (const int slice : order) {
    if (!taken.empty() && voxels + all[slice] > most_looked_at) break;
    voxels += all[slice];
    taken.push_back(slice);
  }
  return taken;
}

struct Shift {
  int axis = -1;
  double mm = 0, against_opposite = 0;
};

/// Means over @p count voxels; known where all are.
Lines together(const Lines& lines, int count) {
  if (count == 1) return lines;
  Lines coarser;
  for (std::size_t n = 0; n + static_cast<std::size_t>(count) <= lines.contrast.size();
       n += static_cast<std::size_t>(count)) {
    const auto from = static_cast<std::ptrdiff_t>(n);
    const float known = *std::min_element(lines.known.begin() + from, lines.known.begin() + from + count);
    const float sum = std::accumulate(lines.contrast.begin() + from, lines.contrast.begin() + from + count, 0.0F);
    coarser.known.push_back(known);
    coarser.contrast.push_back(known * sum / static_cast<float>(count));
  }
  return coarser;
}

/// The shift that explains most against its opposite, of those along one axis.
Shift best_along(const Lines& lines, int axis, double spacing_mm, double w) {
  constexpr double enough = 0.6, tiny = 1e-9;
  const int count = static_cast<int>(std::min(farthest_mm / spacing_mm, farthest_voxels) / step_voxels);
  std::vector<double> left(static_cast<std::size_t>(2 * count));
#pragma omp parallel for schedule(dynamic)
  for (int n = 0; n < 2 * count; ++n) {
    const double shift = step_voxels * (n / 2 + 1) * (n % 2 == 0 ? 1 : -1);
    left[static_cast<std::size_t>(n)] = unmix(lines, Mixing(shift, w), rough).left;
  }
  Shift best;
  for (int n = 0; n < 2 * count; ++n) {
    const double gain = std::log(std::max(left[static_cast<std::size_t>(n ^ 1)], tiny) /
                                 std::max(left[static_cast<std::size_t>(n)], tiny));
    if (gain > best.against_opposite && left[static_cast<std::size_t>(n)] < enough * std::max(left[0], left[1]))
      best = {axis, spacing_mm * step_voxels * (n / 2 + 1) * (n % 2 == 0 ? 1 : -1), gain};
  }
  return best;
}

}  // namespace

std::optional<MovedFat> find_moved_fat(const std::vector<float>& contrast, const Mask& within, const Grid& grid,
                                       double pure) {
  constexpr double least_gain = 0.35;
  if (static_cast<std::size_t>(std::count(within.begin(), within.end(), 1)) < fewest) return {};
  Shift best;
  for (const int axis : axes_of_slices(grid)) {
    const int across = across_slices(grid, axis);
    const std::vector<int> some = slices_to_look_at(contrast, within, grid, across, pure);
    const int count = voxels_together(grid.spacing_mm[axis]);
    const Lines lines = together(lines_of(contrast, within, grid, axis, some, across), count);
    const Shift along = best_along(lines, axis, count * grid.spacing_mm[axis], 1 - pure);
    if (along.against_opposite > best.against_opposite) best = along;
  }
  if (best.axis < 0 || best.against_opposite < least_gain) return {};
  const int across = across_slices(grid, best.axis);
  std::vector<int> all(static_cast<std::size_t>(grid.size[across]));
  std::iota(all.begin(), all.end(), 0);
  const Lines lines = lines_of(contrast, within, grid, best.axis, all, across);
  const Unmixed unmixed = unmix(lines, Mixing(best.mm / grid.spacing_mm[best.axis], 1 - pure), fine);
  MovedFat result{best.mm * grid.direction.col(best.axis), std::vector<float>(contrast.size(), 0)};
  for (std::size_t n = 0; n < lines.voxel.size(); ++n)
    if (lines.known[n] > 0) result.share[lines.voxel[n]] = unmixed.share[n];
  return result;
}

}  // namespace supine::segmentation
