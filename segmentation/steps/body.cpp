// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "segmentation/blur.h"
#include "segmentation/steps/otsu.h"

namespace supine::segmentation {
namespace {

constexpr double standing_out_mm = 1.5;
constexpr double behind_mm = 1;  // of skin: what lies behind so much of it is no air

/// The voxels of the face of the image that looks to the front (-y).
std::vector<std::size_t> front_face(const Grid& grid) {
  Eigen::Index axis = 0;
  grid.direction.row(1).cwiseAbs().maxCoeff(&axis);
  const int at = grid.direction(1, axis) > 0 ? 0 : grid.size[axis] - 1;
  const int u = static_cast<int>(axis + 1) % 3, v = static_cast<int>(axis + 2) % 3;
  std::vector<std::size_t> voxels;
  Eigen::Vector3i n;
  n[axis] = at;
  for (n[v] = 0; n[v] < grid.size[v]; ++n[v])
    for (n[u] = 0; n[u] < grid.size[u]; ++n[u]) voxels.push_back(grid.index(n.x(), n.y(), n.z()));
  return voxels;
}

Mask complement(const Mask& mask) {
  Mask result(mask.size());
  for (std::size_t n = 0; n < mask.size(); ++n) result[n] = !mask[n];
  return result;
}

/// Half the median grey of what is brighter than the air.
float half_of_the_body(const GreyImage& image) {
  const double air = otsu_levels(image.voxels, 4).front();
  std::vector<float> greys;
  for (const float grey : image.voxels)
    if (grey >= air) greys.push_back(grey);
  const auto middle = greys.begin() + static_cast<std::ptrdiff_t>(greys.size() / 2);
  std::nth_element(greys.begin(), middle, greys.end());
  return *middle / 2;
}

/// The largest grey within radius_mm along each axis in turn (a box, which serves as well as a ball).
std::vector<float> local_maximum(const GreyImage& image, double radius_mm) {
  std::vector<float> field = image.voxels, line;
  const Grid& grid = image.grid;
  const auto nx = static_cast<std::size_t>(grid.size.x());
  const std::size_t strides[3] = {1, nx, nx * grid.size.y()};
  for (int axis = 0; axis < 3; ++axis) {
    const int n = grid.size[axis], reach = static_cast<int>(radius_mm / grid.spacing_mm[axis]);
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    line.resize(n);
    for (int b = 0; b < grid.size[v]; ++b)
      for (int a = 0; a < grid.size[u]; ++a) {
        float* first = field.data() + a * strides[u] + b * strides[v];
        for (int q = 0; q < n; ++q) line[q] = first[q * strides[axis]];
        for (int q = 0; q < n; ++q)
          first[q * strides[axis]] =
              *std::max_element(line.begin() + std::max(0, q - reach), line.begin() + std::min(n - 1, q + reach) + 1);
      }
  }
  return field;
}

/// The neighbour down the steepest fall of the distance, or the voxel itself where none falls.
Eigen::Vector3i nearer(const Grid& grid, const std::vector<float>& squared_mm2, const Eigen::Vector3i& at) {
  const auto distance_mm = [&](const Eigen::Vector3i& n) {
    return std::sqrt(squared_mm2[grid.index(n.x(), n.y(), n.z())]);
  };
  Eigen::Vector3i best = at;
  double steepest = 0;
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1), to = at + step;
    if (step.isZero() || !grid.contains(to.x(), to.y(), to.z())) continue;
    const double fall = (distance_mm(at) - distance_mm(to)) / step.cast<double>().cwiseProduct(grid.spacing_mm).norm();
    if (fall <= steepest) continue;
    steepest = fall;
    best = to;
  }
  return best;
}

/// Whether the straight way from a voxel to sure air leads through the skin: at least behind_mm of it is no air.
bool lies_behind_skin(const Grid& grid, const std::vector<float>& squared_mm2, const Mask& air, Eigen::Vector3i at) {
  double solid_mm = 0;
  while (squared_mm2[grid.index(at.x(), at.y(), at.z())] > 0) {
    const Eigen::Vector3i next = nearer(grid, squared_mm2, at);
    if (next == at) return false;
    if (!air[grid.index(next.x(), next.y(), next.z())])
      solid_mm += (next - at).cast<double>().cwiseProduct(grid.spacing_mm).norm();
    if (solid_mm >= behind_mm) return true;
    at = next;
  }
  return false;
}

/// Takes out of the air what came in through a hole in the skin and runs along under it.
void drop_what_lies_behind_skin(const Grid& grid, const Mask& sure, Mask& air) {
  const std::vector<float> squared_mm2 = squared_distance_mm2(sure, grid);
  const Mask before = air;
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        if (before[n] && !sure[n] && lies_behind_skin(grid, squared_mm2, before, {i, j, k})) air[n] = 0;
      }
}

/// Air in front: what is surely air, and from there what is dark within peel_mm of it.
Mask find_air(const GreyImage& image, const Body& step, const Mask& dark) {
  const Grid& grid = image.grid;
  const float sure_level = step.air > 0 ? step.air : step.lower / 2;
  // Single noisy voxels do not close a gap: what is air is seen on greys as blurred as gaps are wide.
  std::vector<float> greys = image.voxels;
  if (step.gap_mm > 0) gaussian_blur(greys, grid, step.gap_mm / 2);
  Mask sure(dark.size());
  for (std::size_t n = 0; n < sure.size(); ++n) sure[n] = greys[n] < sure_level;
  if (step.gap_mm > 0) sure = erode(sure, grid, step.gap_mm);
  sure = flood(sure, grid, front_face(grid));
  const std::vector<float> brightest = step.edge_share > 0 ? local_maximum(image, step.peel_mm) : std::vector<float>();
  Mask near = dilate(sure, grid, step.gap_mm + step.peel_mm);
  std::vector<std::size_t> from;
  for (std::size_t n = 0; n < near.size(); ++n) {
    near[n] = near[n] && (dark[n] || (!brightest.empty() && image.voxels[n] < step.edge_share * brightest[n]));
    if (sure[n]) from.push_back(n);
  }
  Mask air = flood(near, grid, from);
  if (step.edge_share > 0) {
    drop_what_lies_behind_skin(grid, sure, air);
    air = flood(air, grid, from);
  }
  return air;
}

}  // namespace

Mask find_body(const GreyImage& image, const Body& wanted) {
  const Grid& grid = image.grid;
  Body step = wanted;
  if (step.lower == 0) step.lower = half_of_the_body(image);
  Mask dark(image.voxels.size());
  for (std::size_t n = 0; n < dark.size(); ++n) dark[n] = image.voxels[n] < step.lower;
  if (std::find(dark.begin(), dark.end(), 0) == dark.end())
    throw InputError(
        fmt::format("no grey reaches lower = {}; the volume holds no body, or the level is too high", step.lower));
  Mask air = find_air(image, step, dark);
  if (std::find(air.begin(), air.end(), 1) == air.end())
    throw InputError(
        fmt::format("no air (greys below lower = {:.4g}) is found at the front of the image: is it inverted, of "
                    "another kind (noise as bright as suppressed fat), or filled by the body?",
                    step.lower));
  Mask body = keep_islands(complement(air), grid, 1, 0);
  if (step.open_mm > 0) {
    // Only what stands out of the opened body goes: opening as such would round off the body's own corners.
    const Mask opened = dilate(erode(body, grid, step.open_mm), grid, step.open_mm + standing_out_mm);
    for (std::size_t n = 0; n < body.size(); ++n) body[n] = body[n] && opened[n];
    body = keep_islands(body, grid, 1, 0);
  }
  return body;
}

}  // namespace supine::segmentation
