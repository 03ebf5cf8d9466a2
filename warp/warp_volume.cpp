// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/warp_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include "calibration/model_skin.h"
#include "common/error.h"
#include "warp/surroundings.h"

namespace supine::warp {
namespace {

using segmentation::GreyImage;
using segmentation::Grid;

constexpr int slices_at_once = 16;
constexpr double least_air_mm = 3;  // the skin's edge lies in its voxels, blended or not

/// Whether a place of the volume lies in the body there, or next to it.
bool in_body(const std::vector<std::uint8_t>& mask, const Grid& grid, const Eigen::Vector3d& index) {
  const Eigen::Vector3i at = index.array().round().cast<int>();
  const auto is = [&](int i, int j, int k) { return grid.contains(i, j, k) && mask[grid.index(i, j, k)] != 0; };
  return is(at.x(), at.y(), at.z()) || is(at.x() - 1, at.y(), at.z()) || is(at.x() + 1, at.y(), at.z()) ||
         is(at.x(), at.y() - 1, at.z()) || is(at.x(), at.y() + 1, at.z()) || is(at.x(), at.y(), at.z() - 1) ||
         is(at.x(), at.y(), at.z() + 1);
}

class VolumeWarp {
 public:
  VolumeWarp(const TwoShapes& shapes, const GreyImage& volume, const Grid& grid, const WarpOptions& options)
      : volume_(volume),
        grid_(grid),
        sampler_(volume, options.interpolation),
        raster_(shapes.mesh, shapes.target, shapes.source, grid),
        around_(shapes.mesh, shapes.target, shapes.source,
                {options.blend_mm, std::max(options.blend_mm, least_air_mm), false}),
        source_body_(CellRaster(shapes.mesh, shapes.source, shapes.source, volume.grid).mask()),
        background_(options.background.value_or(*std::min_element(volume.voxels.begin(), volume.voxels.end()))) {}

  WarpedVolume run(const std::function<void(double)>& progress) const {
    WarpedVolume result;
    result.image.grid = grid_;
    result.image.voxels.resize(grid_.count());
    Slab slab;
    for (int k = 0; k < grid_.size.z(); k += slices_at_once) {
      slab.start(grid_, k, std::min(slices_at_once, grid_.size.z() - k));
      if (const Overlap overlap = raster_.fill(slab); overlap.voxels > 0) result.overlap.add(overlap);
      around_.fill(grid_, slab);
      sample(slab, result);
      if (progress) progress(static_cast<double>(k + slab.count) / grid_.size.z());
    }
    return result;
  }

 private:
  void sample(const Slab& slab, WarpedVolume& result) const {
    std::size_t body = 0, unseen = 0, left = 0;
#pragma omp parallel for schedule(dynamic) reduction(+ : body, unseen, left)
    for (int s = 0; s < slab.count; ++s) {
      const int k = slab.first + s;
      std::size_t at = static_cast<std::size_t>(s) * grid_.size.x() * grid_.size.y();
      for (int j = 0; j < grid_.size.y(); ++j)
        for (int i = 0; i < grid_.size.x(); ++i, ++at) {
          const Eigen::Vector3d from = grid_.point(Eigen::Vector3d(i, j, k)) + slab.mm[at].cast<double>();
          const Eigen::Vector3d index = volume_.grid.continuous_index(from);
          float& value = result.image.at(i, j, k);
          body += slab.place[at] == Place::body;
          if (slab.place[at] <= Place::beside && in_body(source_body_, volume_.grid, index)) {
            value = background_;
            ++left;
            continue;
          }
          const auto sampled = sampler_.at(index);
          unseen += slab.place[at] == Place::body && !sampled;
          value = sampled.value_or(background_);
        }
    }
    result.body_voxels += body, result.unseen_voxels += unseen, result.left_voxels += left;
  }

  const GreyImage& volume_;
  Grid grid_;
  Sampler sampler_;
  CellRaster raster_;
  Surroundings around_;
  std::vector<std::uint8_t> source_body_;
  float background_;
};

/// MemAvailable; without it as much as one could want.
double free_bytes() {
  std::ifstream info("/proc/meminfo");
  std::string key;
  double kilobytes = 0;
  for (std::string rest; info >> key >> kilobytes && std::getline(info, rest);)
    if (key == "MemAvailable:") return 1024 * kilobytes;
  return std::numeric_limits<double>::infinity();
}

}  // namespace

WarpedVolume warp_volume(const TwoShapes& shapes, const GreyImage& volume, const Grid& grid,
                         const WarpOptions& options) {
  return VolumeWarp(shapes, volume, grid, options).run(options.progress);
}

Grid grown_to_hold(const Grid& grid, const Points& shape, double margin_mm) {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = (grid.size.array() - 1).matrix().cast<double>();
  const Eigen::Vector3d margin = margin_mm * grid.spacing_mm.cwiseInverse();
  for (Eigen::Index p = 0; p < shape.rows(); ++p) {
    const Eigen::Vector3d index = grid.continuous_index(shape.row(p).transpose());
    low = low.cwiseMin(index - margin), high = high.cwiseMax(index + margin);
  }
  const Eigen::Vector3d first = low.array().floor(), last = high.array().ceil();
  Grid grown = grid;
  grown.origin_mm = grid.point(first);
  // Checked against memory by who makes the volume.
  grown.size = (last - first).cast<int>().array() + 1;
  return grown;
}

Grid with_spacing(const Grid& grid, const Eigen::Vector3d& spacing_mm) {
  Grid other = grid;
  const Eigen::Vector3d length = (grid.size.array() - 1).matrix().cast<double>().cwiseProduct(grid.spacing_mm);
  constexpr double most = 1 << 24;  // voxels along an axis; what is beyond is refused by check_memory() anyway
  for (int a = 0; a < 3; ++a)
    other.size[a] = static_cast<int>(std::min(most, std::ceil(length[a] / spacing_mm[a] - 1e-9) + 1));
  other.spacing_mm = spacing_mm;
  return other;
}

void check_memory(const Grid& grid, double bytes_per_voxel) {
  const double voxels = grid.size.cast<double>().prod(), needed = bytes_per_voxel * voxels, there = free_bytes();
  const bool countable = voxels <= std::numeric_limits<int>::max();
  if (needed < 0.9 * there && countable) return;
  const double shrink =
      std::cbrt(std::max(needed / (0.8 * there), voxels / static_cast<double>(std::numeric_limits<int>::max())));
  const Eigen::Vector3d spacing = shrink * grid.spacing_mm;
  throw InputError(
      fmt::format("the grid of {} x {} x {} voxels needs {:.1f} GB and {:.1f} GB are free{}; take --spacing {:.2g} or "
                  "another --like",
                  grid.size.x(), grid.size.y(), grid.size.z(), needed * 1e-9, there * 1e-9,
                  countable ? "" : " (and more than 2^31 voxels are no volume)", spacing.maxCoeff()));
}

double skin_contrast(const meshing::TetMesh& mesh, const Points& shape, const GreyImage& volume) {
  constexpr double way_mm = 3;
  const calibration::ModelSkin skin(mesh, shape);
  const Points places = skin.node_points(), normals = skin.node_normals();
  const Sampler sampler(volume, Interpolation::linear);
  double darker = 0, count = 0;
  for (Eigen::Index p = 0; p < places.rows(); ++p) {
    const auto value = [&](double way) {
      return sampler.at(volume.grid.continuous_index((places.row(p) + way * normals.row(p)).transpose()));
    };
    const auto inside = value(-way_mm), outside = value(way_mm);
    if (!inside || !outside) continue;
    count += 1;
    darker += *outside < *inside ? 1 : *outside == *inside ? 0.5 : 0;
  }
  return count > 0 ? darker / count : 0.5;
}

}  // namespace supine::warp
