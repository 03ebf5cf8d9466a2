// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/perforators.h"

#include <vector>

#include "segmentation/label_map.h"
#include "segmentation/masks.h"
#include "segmentation/tissue.h"

namespace supine::reconstruction {
namespace {

using segmentation::Grid;
using segmentation::LabelImage;
using segmentation::Mask;
using segmentation::meshed_mask;
using segmentation::Tissue;

struct Piece {
  Eigen::Vector3i low = Eigen::Vector3i::Constant(1 << 30), high = Eigen::Vector3i::Constant(-1);
  long muscle_faces = 0, tissue_faces = 0, other_faces = 0;
};

void add_voxel(const LabelImage& image, const Mask& thin, const Eigen::Vector3i& at, Piece& piece) {
  piece.low = piece.low.cwiseMin(at);
  piece.high = piece.high.cwiseMax(at);
  for (int axis = 0; axis < 3; ++axis)
    for (const int step : {-1, 1}) {
      Eigen::Vector3i to = at;
      to[axis] += step;
      if (!image.grid.contains(to.x(), to.y(), to.z())) {
        ++piece.other_faces;
        continue;
      }
      const Tissue beyond = static_cast<Tissue>(image.at(to.x(), to.y(), to.z()));
      if (beyond == Tissue::muscle)
        ++piece.muscle_faces;
      else if (!is_meshed(beyond))
        ++piece.other_faces;
      else if (!thin[image.grid.index(to.x(), to.y(), to.z())])
        ++piece.tissue_faces;
    }
}

bool is_perforator(const Piece& piece, const Grid& grid, double thinnest_mm) {
  const Eigen::Vector3d size_mm =
      (piece.high - piece.low + Eigen::Vector3i::Ones()).cast<double>().cwiseProduct(grid.spacing_mm);
  return size_mm.norm() > thinnest_mm && piece.other_faces == 0 && piece.muscle_faces > 2 * piece.tissue_faces;
}

template <class Visit>
void for_voxels_of(const Mask& mask, const Grid& grid, Visit&& visit) {
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        if (mask[grid.index(i, j, k)]) visit(Eigen::Vector3i(i, j, k));
}

}  // namespace

double turn_perforators_into_muscle(LabelImage& image, double thinnest_mm) {
  const double radius_mm = 0.5 * thinnest_mm;
  if (radius_mm < image.grid.spacing_mm.minCoeff()) return 0;  // no ball smaller than a voxel opens anything
  const Grid& grid = image.grid;
  Mask thin = meshed_mask(image);
  const Mask opened = segmentation::dilate(segmentation::erode(thin, grid, radius_mm), grid, radius_mm);
  for (std::size_t v = 0; v < thin.size(); ++v) thin[v] = thin[v] && !opened[v];
  const segmentation::Components components = segmentation::connected_components(thin, grid);
  std::vector<Piece> pieces(components.size.size());
  for_voxels_of(thin, grid, [&](const Eigen::Vector3i& at) {
    add_voxel(image, thin, at, pieces[components.number[grid.index(at.x(), at.y(), at.z())] - 1]);
  });
  std::size_t turned = 0;
  for (std::size_t v = 0; v < thin.size(); ++v) {
    if (!thin[v] || !is_perforator(pieces[components.number[v] - 1], grid, thinnest_mm)) continue;
    image.voxels[v] = static_cast<std::uint8_t>(Tissue::muscle);
    ++turned;
  }
  return static_cast<double>(turned) * grid.voxel_volume_mm3();
}

}  // namespace supine::reconstruction
