// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reconstruction/handles.h"
#include "reconstruction/regions.h"
#include "reconstruction/surface_check.h"

namespace supine::reconstruction {

struct ReconstructOptions {
  CutRules cut;
  /// Fairing length, mm, >= 0 (see FairingOptions); nothing = 0.75 of the largest voxel side.
  std::optional<double> smooth_mm;
  /// Loose bits of meshed tissue below this are left out of the breast: a solver cannot hold them.
  double smallest_piece_mm3 = 100;
  /// Perforators (strands of tissue inside the muscle) that are thinner than this count as muscle. 0: neither they nor
  /// handles (see close_handles()) are touched.
  double thinnest_mm = 3;
  /// An organ that would have more triangles is made from blocks of voxels; >= 1000.
  int most_organ_triangles = 300000;

  void check() const;  ///< @throws InputError naming option, value and bound
};

/// A closed surface with what was measured on it.
struct OrganSurface {
  std::string name;             ///< "breast", or the tissue's name
  Surface surface;              ///< closed, manifold, outward, no self-intersections; LPS mm
  SurfaceReport report;         ///< of the surface
  double voxel_volume_mm3 = 0;  ///< of the image's voxels it stands for
  int voxel_components = 0;     ///< pieces of those voxels, joined through faces
  int dropped_pieces = 0;       ///< left out for their size (breast only)
  double dropped_volume_mm3 = 0;
  double perforator_volume_mm3 = 0;    ///< counted as muscle (breast only)
  HandleRepair handles;                ///< what was done about them (breast only)
  double voxel_mm = 0;                 ///< largest side of the voxels the surface was made from
  std::size_t self_intersections = 0;  ///< counted on the surface; 0
  Eigen::Index less_smooth_points =
      0;  ///< points kept nearer to the staircase because the smooth surface crossed itself

  double volume_error() const { return report.volume_mm3 / voxel_volume_mm3 - 1; }
};

struct Reconstruction {
  OrganSurface breast;  ///< boundary of all tissues that are meshed, with regions inner, skin and cut
  Surface muscle;       ///< breast-facing muscle sheet, open: the inner faces turned round, so normals face the breast
  std::vector<OrganSurface> organs;  ///< gland, tumour, nipple and vessel, as far as there are any
};

/// The faces of one region, turned round, as a surface of their own.
Surface reversed_region(const Surface& surface, Region region);

/// Makes the surfaces of a label volume.
///
/// Marching cubes on the labels, regions from the voxel beyond, fairing within half a voxel (see fair()), and a normal
/// offset (at most half a voxel) that gives every piece the volume of its voxels; what pieces thinner than a voxel lack
/// is given to the others, within a quarter of a voxel. Where the result crosses itself it is taken back toward the
/// staircase, which does not. Organs that touch are shaped together and have the vertices of their interface in common
/// (see shape_together()), but for those made from blocks.
/// @throws InputError  no tissue to mesh, no muscle, no part of the tissue on the muscle, or a cut that is not allowed
///   (see regions_of)
Reconstruction reconstruct(const segmentation::LabelImage& image, const ReconstructOptions& options);

}  // namespace supine::reconstruction
