// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/reconstruct.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "reconstruction/fairing.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/prongs.h"

namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;

constexpr double default_smooth_voxels = 0.75;
constexpr double largest_offset_voxels = 0.5;  // fairing cannot shrink by more
constexpr double negligible_volume = 1e-4;
constexpr Tissue organ_tissues[] = {Tissue::gland, Tissue::tumour, Tissue::nipple, Tissue::vessel};

struct PieceSizes {
  std::vector<double> volume_mm3, area_mm2;
};

PieceSizes measure_pieces(const VoxelSurface& voxels, const Surface& surface) {
  PieceSizes sizes{std::vector<double>(voxels.piece_volume_mm3.size(), 0.0), {}};
  sizes.area_mm2 = sizes.volume_mm3;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const int piece = voxels.piece(surface.triangles(t, 0));
    const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0)),
                             b = surface.points.row(surface.triangles(t, 1)),
                             c = surface.points.row(surface.triangles(t, 2));
    sizes.volume_mm3[piece] += a.dot(b.cross(c)) / 6;
    sizes.area_mm2[piece] += 0.5 * (b - a).cross(c - a).norm();
  }
  return sizes;
}

void offset_pieces(const VoxelSurface& voxels, const std::vector<double>& step_mm, Surface& surface) {
  const Points normals = point_normals(surface.points, surface.triangles);
  for (Eigen::Index p = 0; p < normals.rows(); ++p) surface.points.row(p) += step_mm[voxels.piece(p)] * normals.row(p);
}

// Moves every piece along its normals until it has the volume of its voxels, as far as the bound allows; what is then
// missing of the whole is made up by all pieces that are not at the bound.
void restore_volume(const VoxelSurface& voxels, double bound_mm, Surface& surface) {
  const std::size_t pieces = voxels.piece_volume_mm3.size();
  std::vector<double> offset_mm(pieces, 0.0), step_mm(pieces, 0.0);
  for (int round = 0; round < 3; ++round) {
    const PieceSizes sizes = measure_pieces(voxels, surface);
    for (std::size_t i = 0; i < pieces; ++i) {
      const double wanted = offset_mm[i] + (voxels.piece_volume_mm3[i] - sizes.volume_mm3[i]) / sizes.area_mm2[i];
      step_mm[i] = std::clamp(wanted, -bound_mm, bound_mm) - offset_mm[i];
      offset_mm[i] += step_mm[i];
    }
    offset_pieces(voxels, step_mm, surface);
  }
  const PieceSizes sizes = measure_pieces(voxels, surface);
  double missing = voxels.voxel_volume_mm3(), area = 0;
  for (std::size_t i = 0; i < pieces; ++i) {
    missing -= sizes.volume_mm3[i];
    if (std::abs(offset_mm[i]) < bound_mm) area += sizes.area_mm2[i];
  }
  if (area <= 0 || std::abs(missing) < negligible_volume * voxels.voxel_volume_mm3()) return;
  const double common_mm = std::clamp(missing / area, -0.5 * bound_mm, 0.5 * bound_mm);
  for (std::size_t i = 0; i < pieces; ++i) step_mm[i] = std::abs(offset_mm[i]) < bound_mm ? common_mm : 0;
  offset_pieces(voxels, step_mm, surface);
}

// Halves the displacement from the staircase around crossings until there are none. @return points that were held back
Eigen::Index remove_crossings(const Points& staircase, Surface& surface) {
  const Points displacement = surface.points - staircase;
  const auto neighbours = point_neighbours(mesh_edges(surface.triangles), surface.points.rows());
  Eigen::VectorXd share = Eigen::VectorXd::Ones(surface.points.rows());
  constexpr int most_rounds = 40;
  for (int round = 0; round < most_rounds; ++round) {
    const auto crossings = self_intersections(surface);
    if (crossings.empty()) return (share.array() < 1).count();
    std::vector<char> hit(surface.points.rows(), 0);
    for (const auto& [a, b] : crossings)
      for (int c = 0; c < 3; ++c) hit[surface.triangles(a, c)] = hit[surface.triangles(b, c)] = 1;
    const std::vector<char> core = hit;
    for (std::size_t p = 0; p < core.size(); ++p)
      if (core[p])
        for (const int n : neighbours[p]) hit[n] = 1;
    for (std::size_t p = 0; p < hit.size(); ++p)
      if (hit[p]) share(static_cast<Eigen::Index>(p)) *= round < most_rounds / 2 ? 0.5 : 0;
    surface.points = staircase + displacement.cwiseProduct(share.replicate<1, 3>());
  }
  const auto crossings = self_intersections(surface);
  if (!crossings.empty())
    throw NumericalFailure(
        fmt::format("the smoothed surface crosses itself in {} places and could not be repaired; give a "
                    "smaller --smooth-mm",
                    crossings.size()));
  return (share.array() < 1).count();
}

OrganSurface finish(std::string name, const VoxelSurface& voxels, Eigen::VectorXi region, const LabelImage& image,
                    const ReconstructOptions& options) {
  OrganSurface organ;
  organ.name = std::move(name);
  Surface surface = voxels.surface;
  surface.region = std::move(region);
  FairingOptions fairing;
  fairing.spacing_mm = image.grid.spacing_mm;
  fairing.length_mm = options.smooth_mm.value_or(default_smooth_voxels * image.grid.spacing_mm.maxCoeff());
  surface.points = fair(surface, fairing);
  restore_volume(voxels, largest_offset_voxels * image.grid.spacing_mm.minCoeff(), surface);
  organ.less_smooth_points = remove_crossings(voxels.surface.points, surface);
  organ.surface = to_patient(std::move(surface), image.grid);
  organ.report = check_surface(organ.surface);
  organ.self_intersections = self_intersections(organ.surface).size();
  organ.voxel_volume_mm3 = voxels.voxel_volume_mm3();
  organ.voxel_mm = image.grid.spacing_mm.maxCoeff();
  organ.voxel_components = static_cast<int>(voxels.piece_volume_mm3.size());
  organ.dropped_pieces = voxels.dropped_pieces;
  organ.dropped_volume_mm3 = voxels.dropped_volume_mm3;
  return organ;
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

std::optional<OrganSurface> organ_surface(const LabelImage& image, Tissue tissue, const ReconstructOptions& options) {
  const VoxelSurface fine = voxel_surface(image, only(tissue));
  if (fine.surface.triangles.rows() == 0) return std::nullopt;
  const std::string name(segmentation::tissue_names[static_cast<int>(tissue)]);
  const double excess = static_cast<double>(fine.surface.triangles.rows()) / options.most_organ_triangles;
  if (excess <= 1) return finish(name, fine, {}, image, options);
  const LabelImage coarse = in_blocks(image, tissue, static_cast<int>(std::ceil(std::sqrt(excess))));
  VoxelSurface blocks = voxel_surface(coarse, only(tissue));
  const double scale = fine.voxel_volume_mm3() / blocks.voxel_volume_mm3();
  for (double& volume : blocks.piece_volume_mm3) volume *= scale;  // what the blocks miss is given back by the offset
  OrganSurface organ = finish(name, blocks, {}, coarse, options);
  organ.voxel_volume_mm3 = fine.voxel_volume_mm3();
  organ.voxel_components = static_cast<int>(fine.piece_volume_mm3.size());
  return organ;
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

// The faces of one region, turned round, as a surface of their own.
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

}  // namespace

void ReconstructOptions::check() const {
  if (smooth_mm && !(*smooth_mm >= 0)) throw InputError(fmt::format("smooth_mm is {}; it must be >= 0", *smooth_mm));
  if (!(cut.rim_mm > 0)) throw InputError(fmt::format("rim_mm is {}; it must be > 0", cut.rim_mm));
  if (!(smallest_piece_mm3 >= 0))
    throw InputError(fmt::format("smallest_piece_mm3 is {}; it must be >= 0", smallest_piece_mm3));
  if (!(thinnest_mm >= 0)) throw InputError(fmt::format("thinnest_mm is {}; it must be >= 0", thinnest_mm));
  if (most_organ_triangles < 1000)
    throw InputError(fmt::format("most_organ_triangles is {}; it must be >= 1000", most_organ_triangles));
}

Reconstruction reconstruct(const LabelImage& image, const ReconstructOptions& options) {
  options.check();
  require_tissues(image);
  Reconstruction result;
  LabelImage without_prongs = image;
  const double prong_volume_mm3 = turn_prongs_into_muscle(without_prongs, options.thinnest_mm);
  const VoxelSurface breast = voxel_surface(without_prongs, meshed_tissues(), options.smallest_piece_mm3);
  result.breast = finish("breast", breast, regions_of(breast, without_prongs, options.cut), without_prongs, options);
  result.breast.prong_volume_mm3 = prong_volume_mm3;
  result.muscle = reversed_region(result.breast.surface, Region::inner);
  if (result.muscle.triangles.rows() == 0)
    throw InputError("no tissue to be meshed borders on the muscle; check the labels of muscle and of what lies on it");
  for (const Tissue tissue : organ_tissues)
    if (auto organ = organ_surface(image, tissue, options)) result.organs.push_back(std::move(*organ));
  return result;
}

}  // namespace supine::reconstruction
