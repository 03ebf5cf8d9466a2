// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/reconstruct.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "reconstruction/perforators.h"
#include "reconstruction/shaping.h"

namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;

constexpr double default_smooth_voxels = 0.75;
constexpr Tissue organ_tissues[] = {Tissue::gland, Tissue::tumour, Tissue::nipple, Tissue::vessel};

OrganSurface finished(std::string name, const VoxelSurface& voxels, ShapedSurface shaped, const LabelImage& image) {
  OrganSurface organ;
  organ.name = std::move(name);
  organ.less_smooth_points = shaped.less_smooth_points;
  organ.surface = to_patient(std::move(shaped.surface), image.grid);
  organ.report = check_surface(organ.surface);
  organ.self_intersections = self_intersections(organ.surface).size();
  organ.voxel_volume_mm3 = voxels.voxel_volume_mm3();
  organ.voxel_mm = image.grid.spacing_mm.maxCoeff();
  organ.voxel_components = static_cast<int>(voxels.piece_volume_mm3.size());
  organ.dropped_pieces = voxels.dropped_pieces;
  organ.dropped_volume_mm3 = voxels.dropped_volume_mm3;
  return organ;
}

ShapingOptions shaping(const LabelImage& image, const ReconstructOptions& options) {
  const Eigen::Vector3d& spacing_mm = image.grid.spacing_mm;
  return {spacing_mm, options.smooth_mm.value_or(default_smooth_voxels * spacing_mm.maxCoeff())};
}

OrganSurface finish(std::string name, const VoxelSurface& voxels, const LabelImage& image,
                    const ReconstructOptions& options) {
  return finished(std::move(name), voxels, shape_together({&voxels}, shaping(image, options)).front(), image);
}

// A coarser mask of one tissue: blocks of voxels count as in above the share that keeps the volume best.
LabelImage in_blocks(const LabelImage& image, Tissue tissue, int factor) {
  LabelImage coarse;
  coarse.grid = image.grid;
  coarse.grid.size = (image.grid.size.array() + factor - 1) / factor;
  coarse.grid.spacing_mm = factor * image.grid.spacing_mm;
  coarse.grid.origin_mm = image.grid.point(Eigen::Vector3d::Constant(0.5 * (factor - 1)));
  std::vector<std::uint16_t> share(coarse.grid.count(), 0);
  for (int k = 0; k < image.grid.size.z(); ++k)
    for (int j = 0; j < image.grid.size.y(); ++j)
      for (int i = 0; i < image.grid.size.x(); ++i)
        share[coarse.grid.index(i / factor, j / factor, k / factor)] +=
            static_cast<Tissue>(image.at(i, j, k)) == tissue;
  const int full = factor * factor * factor;
  std::vector<long> blocks(full + 1, 0);
  long voxels = 0;
  for (const std::uint16_t s : share) {
    ++blocks[s];
    voxels += s;
  }
  int threshold = full + 1;
  for (long in = 0; threshold > 1 && 2 * in * full + blocks[threshold - 1] * full <= 2 * voxels;
       in += blocks[threshold])
    --threshold;
  coarse.voxels.resize(share.size());
  for (std::size_t b = 0; b < share.size(); ++b)
    coarse.voxels[b] = static_cast<std::uint8_t>(share[b] >= threshold ? tissue : Tissue::air);
  return coarse;
}

OrganSurface organ_from_blocks(std::string name, const VoxelSurface& fine, const LabelImage& coarse, Tissue tissue,
                               const ReconstructOptions& options) {
  VoxelSurface blocks = voxel_surface(coarse, only(tissue));
  const double scale = fine.voxel_volume_mm3() / blocks.voxel_volume_mm3();
  for (double& volume : blocks.piece_volume_mm3) volume *= scale;  // what the blocks miss is given back by the offset
  OrganSurface organ = finish(std::move(name), blocks, coarse, options);
  organ.voxel_volume_mm3 = fine.voxel_volume_mm3();
  organ.voxel_components = static_cast<int>(fine.piece_volume_mm3.size());
  return organ;
}

std::vector<OrganSurface> organ_surfaces(const LabelImage& image, const ReconstructOptions& options) {
  std::vector<OrganSurface> organs;
  std::vector<VoxelSurface> fine;  // those with their own voxels, and where they belong
  std::vector<std::size_t> place;
  for (const Tissue tissue : organ_tissues) {
    VoxelSurface voxels = voxel_surface(image, only(tissue));
    if (voxels.surface.triangles.rows() == 0) continue;
    const std::string name(segmentation::tissue_names[static_cast<int>(tissue)]);
    const double excess = static_cast<double>(voxels.surface.triangles.rows()) / options.most_organ_triangles;
    if (excess > 1) {
      const LabelImage coarse = in_blocks(image, tissue, static_cast<int>(std::ceil(std::sqrt(excess))));
      organs.push_back(organ_from_blocks(name, voxels, coarse, tissue, options));
      continue;
    }
    place.push_back(organs.size());
    organs.emplace_back().name = name;
    fine.push_back(std::move(voxels));
  }
  std::vector<const VoxelSurface*> all;
  for (const VoxelSurface& voxels : fine) all.push_back(&voxels);
  for (const std::vector<int>& group : touching_groups(all)) {
    std::vector<const VoxelSurface*> members;
    for (const int n : group) members.push_back(all[n]);
    std::vector<ShapedSurface> shaped = shape_together(members, shaping(image, options));
    for (std::size_t m = 0; m < group.size(); ++m) {
      OrganSurface& organ = organs[place[group[m]]];
      organ = finished(organ.name, *members[m], std::move(shaped[m]), image);
    }
  }
  return organs;
}

void require_tissues(const LabelImage& image) {
  bool meshed = false, muscle = false;
  for (const std::uint8_t voxel : image.voxels) {
    meshed |= is_meshed(static_cast<Tissue>(voxel));
    muscle |= static_cast<Tissue>(voxel) == Tissue::muscle;
  }
  if (!meshed)
    throw InputError(
        "the labels hold no tissue to mesh (adipose, gland, skin, ...); check the table [image.labels] of case.toml");
  if (!muscle)
    throw InputError(
        "the labels hold no muscle; the breast needs something to lie on: label the chest wall as `muscle` in "
        "[image.labels] of case.toml");
}

}  // namespace

Surface reversed_region(const Surface& surface, Region region) {
  Surface sheet;
  std::vector<int> renumbered(surface.points.rows(), -1);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    if (surface.region(t) == static_cast<int>(region)) kept.push_back(t);
  sheet.triangles.resize(static_cast<Eigen::Index>(kept.size()), 3);
  sheet.points.resize(surface.points.rows(), 3);
  int points = 0;
  for (std::size_t i = 0; i < kept.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const int p = surface.triangles(kept[i], 2 - c);
      if (renumbered[p] < 0) {
        sheet.points.row(points) = surface.points.row(p);
        renumbered[p] = points++;
      }
      sheet.triangles(static_cast<Eigen::Index>(i), c) = renumbered[p];
    }
  sheet.points.conservativeResize(points, 3);
  return sheet;
}

void ReconstructOptions::check() const {
  constexpr double most_smooth_mm = 20, most_piece_mm3 = 1e6;
  if (smooth_mm && !(*smooth_mm >= 0 && *smooth_mm <= most_smooth_mm))
    throw InputError(fmt::format("smooth_mm is {}; it must lie in [0, {}]", *smooth_mm, most_smooth_mm));
  if (!(cut.rim_mm > 0)) throw InputError(fmt::format("rim_mm is {}; it must be > 0", cut.rim_mm));
  if (!(smallest_piece_mm3 >= 0 && smallest_piece_mm3 <= most_piece_mm3))
    throw InputError(
        fmt::format("smallest_piece_mm3 is {}; it must lie in [0, {}]", smallest_piece_mm3, most_piece_mm3));
  if (!(thinnest_mm >= 0)) throw InputError(fmt::format("thinnest_mm is {}; it must be >= 0", thinnest_mm));
  if (most_organ_triangles < 1000)
    throw InputError(fmt::format("most_organ_triangles is {}; it must be >= 1000", most_organ_triangles));
}

Reconstruction reconstruct(const LabelImage& image, const ReconstructOptions& options) {
  options.check();
  require_tissues(image);
  Reconstruction result;
  LabelImage body = image;
  const double perforator_volume_mm3 = turn_perforators_into_muscle(body, options.thinnest_mm);
  HandleRepair handles;
  if (options.thinnest_mm > 0) handles = close_handles(body);
  VoxelSurface breast = voxel_surface(body, meshed_tissues(), options.smallest_piece_mm3);
  breast.surface.region = regions_of(breast, body, options.cut);
  result.breast = finish("breast", breast, body, options);
  result.breast.perforator_volume_mm3 = perforator_volume_mm3;
  result.breast.handles = std::move(handles);
  result.muscle = reversed_region(result.breast.surface, Region::inner);
  if (result.muscle.triangles.rows() == 0)
    throw InputError("no tissue to be meshed borders on the muscle; check the labels of muscle and of what lies on it");
  result.organs = organ_surfaces(image, options);
  return result;
}

}  // namespace supine::reconstruction
