// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/second_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/statistics.h"
#include "segmentation/blur.h"
#include "segmentation/chest/sampler.h"

namespace supine::segmentation {
namespace {

constexpr double blur_mm = 1.5;  // of both series before their gradients
constexpr double around_mm = 6;  // of the breast: its skin takes part
constexpr std::size_t most_points = 6000;
constexpr double farthest_mm = 10, coarse_mm = 2, fine_mm = 0.5;
constexpr double least_peak = 1.25;    // of the agreement of edges at the best shift, over its median over all
constexpr double least_covered = 0.9;  // of the breast
constexpr double fat_grey = 100;

using Places = std::vector<Eigen::Vector3d>;
using Vectors = Image<Eigen::Vector3f>;

/// Gradients g of the blurred image as g / sqrt(|g|² + η²), η the mean of |g| where there are any: edges count by their
/// direction, noise hardly.
Vectors edges_of(const GreyImage& image) {
  const Grid& grid = image.grid;
  std::vector<float> smooth = image.voxels;
  gaussian_blur(smooth, grid, blur_mm);
  Vectors edges{grid, std::vector<Eigen::Vector3f>(smooth.size(), Eigen::Vector3f::Zero())};
  const std::ptrdiff_t step[3] = {1, grid.size.x(), static_cast<std::ptrdiff_t>(grid.size.x()) * grid.size.y()};
  double sum = 0;
  for (int k = 1; k + 1 < grid.size.z(); ++k)
    for (int j = 1; j + 1 < grid.size.y(); ++j)
      for (int i = 1; i + 1 < grid.size.x(); ++i) {
        const auto n = static_cast<std::ptrdiff_t>(grid.index(i, j, k));
        Eigen::Vector3d g;
        for (int a = 0; a < 3; ++a) g[a] = (smooth[n + step[a]] - smooth[n - step[a]]) / (2 * grid.spacing_mm[a]);
        edges.voxels[n] = (grid.direction * g).cast<float>();
        sum += g.norm();
      }
  const auto mean = static_cast<float>(std::max(1e-6, sum / static_cast<double>(smooth.size() + 1)));
  for (Eigen::Vector3f& g : edges.voxels) g /= std::sqrt(g.squaredNorm() + mean * mean);
  return edges;
}

/// The voxel nearest to a point; zero beyond the image.
Eigen::Vector3f nearest(const Vectors& edges, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3i n = edges.grid.continuous_index(point_mm).array().round().cast<int>();
  return edges.grid.contains(n.x(), n.y(), n.z()) ? edges.at(n.x(), n.y(), n.z()) : Eigen::Vector3f::Zero().eval();
}

struct Edge {
  Eigen::Vector3d place;
  Eigen::Vector3f direction;
};

/// The clear edges in and around the breast, some of them.
std::vector<Edge> clear_edges(const GreyImage& image, const Mask& breast) {
  const Vectors edges = edges_of(image);
  const Mask near = dilate(breast, image.grid, around_mm);
  constexpr float clear = 0.7F;  // as long as the mean gradient
  std::vector<Edge> all;
  for (int k = 0; k < image.grid.size.z(); ++k)
    for (int j = 0; j < image.grid.size.y(); ++j)
      for (int i = 0; i < image.grid.size.x(); ++i)
        if (const std::size_t n = image.grid.index(i, j, k); near[n] && edges.voxels[n].norm() > clear)
          all.push_back({image.grid.point(Eigen::Vector3d(i, j, k)), edges.voxels[n]});
  const std::size_t stride = std::max<std::size_t>(1, all.size() / most_points);
  std::vector<Edge> some;
  for (std::size_t n = 0; n < all.size(); n += stride) some.push_back(all[n]);
  return some;
}

/// How well edges lie on edges of either sense (Haber and Modersitzki, MICCAI 2006, normalised gradient fields).
double agreement(const std::vector<Edge>& first, const Vectors& second, const Eigen::Vector3d& shift) {
  double sum = 0;
  for (const Edge& edge : first) sum += std::pow(edge.direction.dot(nearest(second, edge.place + shift)), 2);
  return sum / static_cast<double>(std::max<std::size_t>(1, first.size()));
}

/// The best shift of a lattice, and the agreement at all of them.
struct Lattice {
  Eigen::Vector3d best;
  std::vector<double> agreement;
};

Lattice search(const std::vector<Edge>& first, const Vectors& second, const Eigen::Vector3d& middle, double reach_mm,
               double step_mm) {
  const int steps = static_cast<int>(std::lround(reach_mm / step_mm)), side = 2 * steps + 1;
  Lattice lattice{middle, std::vector<double>(static_cast<std::size_t>(side) * side * side)};
  const auto shift = [&](int n) {
    const Eigen::Vector3d index(n % side - steps, n / side % side - steps, n / (side * side) - steps);
    return Eigen::Vector3d(middle + step_mm * index);
  };
  const auto count = static_cast<int>(lattice.agreement.size());
#pragma omp parallel for schedule(dynamic)
  for (int n = 0; n < count; ++n) lattice.agreement[static_cast<std::size_t>(n)] = agreement(first, second, shift(n));
  lattice.best = shift(static_cast<int>(std::max_element(lattice.agreement.begin(), lattice.agreement.end()) -
                                        lattice.agreement.begin()));
  return lattice;
}

double median_of(const std::vector<double>& values) {
  return median(Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
}

Eigen::Vector3d find_shift(const GreyImage& image, const GreyImage& series, const Mask& breast) {
  const std::vector<Edge> first = clear_edges(image, breast);
  const Vectors second = edges_of(series);
  Lattice coarse = search(first, second, Eigen::Vector3d::Zero(), farthest_mm, coarse_mm);
  const Lattice fine = search(first, second, coarse.best, coarse_mm, fine_mm);
  const double best = *std::max_element(fine.agreement.begin(), fine.agreement.end());
  const double usual = median_of(coarse.agreement);
  if (!(best > least_peak * usual))
    throw InputError(
        fmt::format("the second series does not show this body: wherever it is moved within {:g} mm, edges in it lie "
                    "on those of the first no better than by chance ({:.2f} times, bound {:g}); is it of the same "
                    "visit and frame?",
                    farthest_mm, best / usual, least_peak));
  if (coarse.best.cwiseAbs().maxCoeff() > farthest_mm - 0.5 * coarse_mm)
    throw InputError(fmt::format(
        "the second series lies ({:.1f}, {:.1f}, {:.1f}) mm from the first, or further (bound {:g} mm along "
        "each axis): she moved, or it has another frame; register it first",
        fine.best.x(), fine.best.y(), fine.best.z(), farthest_mm));
  return fine.best;
}

/// Places inside a voxel whose greys are averaged: as many along each axis as finer voxels of the series go into it.
Places inside_a_voxel(const Grid& grid, const Grid& finer) {
  std::array<int, 3> count{};
  for (int a = 0; a < 3; ++a)
    count[a] = std::clamp(static_cast<int>(std::lround(grid.spacing_mm[a] / finer.spacing_mm.minCoeff())), 1, 4);
  Places places;
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i)
        places.emplace_back((i + 0.5) / count[0] - 0.5, (j + 0.5) / count[1] - 0.5, (k + 0.5) / count[2] - 0.5);
  return places;
}

float mean_over_voxel(const GreyImage& series, const Grid& grid, const Eigen::Vector3d& index,
                      const Eigen::Vector3d& shift, const Places& parts) {
  double sum = 0;
  for (const Eigen::Vector3d& part : parts) sum += sample(series, grid.point(index + part) + shift);
  return static_cast<float>(sum / static_cast<double>(parts.size()));
}

/// Median grey of those voxels that the series reaches; 0 where it reaches none.
double median_grey(const GreyImage& image, const Mask& mask) {
  std::vector<double> greys;
  for (std::size_t n = 0; n < mask.size(); ++n)
    if (mask[n] && std::isfinite(image.voxels[n])) greys.push_back(image.voxels[n]);
  return greys.empty() ? 0 : median_of(greys);
}

void check_covered(const GreyImage& image, const Mask& breast) {
  std::size_t there = 0, all = 0;
  for (std::size_t n = 0; n < breast.size(); ++n)
    if (breast[n]) ++all, there += std::isfinite(image.voxels[n]);
  const double share = static_cast<double>(there) / static_cast<double>(std::max<std::size_t>(1, all));
  if (share < least_covered)
    throw InputError(
        fmt::format("the second series reaches over {:.0f} % of the breast (bound {:.0f} %): it is of another place or "
                    "frame, or shows another part",
                    100 * share, 100 * least_covered));
}

}  // namespace

SecondSeries lay_over(const GreyImage& series, const GreyImage& image, const Mask& breast, const Mask& under_skin) {
  const Grid& grid = image.grid;
  SecondSeries second{{grid, std::vector<float>(grid.count(), std::numeric_limits<float>::quiet_NaN())},
                      find_shift(image, series, breast)};
  const Places parts = inside_a_voxel(grid, series.grid);
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        if (const std::size_t n = grid.index(i, j, k); breast[n])
          second.image.voxels[n] = mean_over_voxel(series, grid, Eigen::Vector3d(i, j, k), second.shift_mm, parts);
  check_covered(second.image, breast);
  const double fat = median_grey(second.image, under_skin);
  if (!(fat > 0))
    throw InputError(
        "the fat of the second series is no brighter than its noise (median 0 under the breast's skin): gland cannot "
        "be "
        "told from it by a contrast; leave the series out");
  for (float& grey : second.image.voxels) grey *= static_cast<float>(fat_grey / fat);
  return second;
}

FatLevel share_by_both(const SeriesContrast& first, const SeriesContrast& second) {
  FatLevel both = first.fat;
  std::vector<double> deviations;
  for (std::size_t n = 0; n < both.contrast.size(); ++n) {
    double sum = 0, information = 0;
    for (const SeriesContrast* one : {&first, &second}) {
      if (!one->usable[n]) continue;
      const double s = one->fat.deviation[n];
      sum += one->pure * one->fat.contrast[n] / (s * s);
      information += one->pure * one->pure / (s * s);
    }
    both.contrast[n] = information > 0 ? static_cast<float>(sum / information) : 0.0F;
    both.deviation[n] = information > 0 ? static_cast<float>(1 / std::sqrt(information)) : 1.0F;
    if (information > 0) deviations.push_back(both.deviation[n]);
  }
  if (!deviations.empty()) both.sd = median_of(deviations);
  return both;
}

void check_contrast(const SeriesContrast& first, const SeriesContrast& second) {
  constexpr float clear_share = 0.5F;
  constexpr std::size_t fewest = 100;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t n = 0; n < first.usable.size(); ++n) {
    if (!first.usable[n] || !second.usable[n] || first.fat.contrast[n] < clear_share * first.pure) continue;
    sum += second.fat.contrast[n];
    ++count;
  }
  if (count < fewest || sum > 0) return;
  throw InputError(fmt::format(
      "where the first series shows gland, the second differs from its fat by {:.0f} % to the other side: one "
      "of the two is to be with fat suppression and one without, as the recipe's `contrast` and `second` say",
      -100 * sum / static_cast<double>(count)));
}

}  // namespace supine::segmentation
