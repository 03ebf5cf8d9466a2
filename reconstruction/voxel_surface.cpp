// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/voxel_surface.h"

#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;

// The voxels of the set within their bounding box, widened by one layer that is outside.
struct Mask {
  Eigen::Vector3i first, size;  // first voxel of the box (may be −1), voxels along each axis
  std::vector<unsigned char> in;

  std::size_t index(int i, int j, int k) const {
    return i + static_cast<std::size_t>(size.x()) * (j + static_cast<std::size_t>(size.y()) * k);
  }
};

Mask mask_of(const LabelImage& image, const TissueSet& members) {
  const Eigen::Vector3i n = image.grid.size;
  Eigen::Vector3i low = n, high = Eigen::Vector3i::Constant(-1);
  const auto for_members = [&](auto&& visit) {
    for (int k = 0; k < n.z(); ++k)
      for (int j = 0; j < n.y(); ++j)
        for (int i = 0; i < n.x(); ++i)
          if (members[image.at(i, j, k)]) visit(Eigen::Vector3i(i, j, k));
  };
  for_members([&](const Eigen::Vector3i& v) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  });
  Mask mask;
  mask.size.setZero();
  if (high.x() < 0) return mask;
  mask.first = low.array() - 1;
  mask.size = high - low + Eigen::Vector3i::Constant(3);
  mask.in.assign(mask.index(0, 0, mask.size.z()), 0);
  for_members([&](const Eigen::Vector3i& v) {
    const Eigen::Vector3i m = v - mask.first;
    mask.in[mask.index(m.x(), m.y(), m.z())] = 1;
  });
  return mask;
}

struct Pieces {
  std::vector<std::int32_t> number;  // of every voxel of the mask's box, −1 outside the set
  std::vector<std::size_t> voxels;   // of every piece
};

Pieces find_pieces(const Mask& mask) {
  const std::ptrdiff_t row = mask.size.x(), slice = row * mask.size.y();
  const std::ptrdiff_t steps[6] = {1, -1, row, -row, slice, -slice};
  Pieces pieces;
  pieces.number.assign(mask.in.size(), -1);
  std::vector<std::size_t> stack;
  for (std::size_t seed = 0; seed < mask.in.size(); ++seed) {
    if (!mask.in[seed] || pieces.number[seed] >= 0) continue;
    const auto piece = static_cast<std::int32_t>(pieces.voxels.size());
    pieces.voxels.push_back(0);
    pieces.number[seed] = piece;
    stack.assign(1, seed);
    while (!stack.empty()) {
      const std::size_t at = stack.back();
      stack.pop_back();
      ++pieces.voxels.back();
      for (const std::ptrdiff_t step : steps) {  // the outer layer is empty, so no step leaves the box
        if (!mask.in[at + step] || pieces.number[at + step] >= 0) continue;
        pieces.number[at + step] = piece;
        stack.push_back(at + step);
      }
    }
  }
  return pieces;
}

// Takes pieces below the size out of mask and pieces, renumbers the others, and notes what stays and what goes.
void drop_small_pieces(Mask& mask, Pieces& pieces, double voxel_mm3, double smallest_piece_mm3, VoxelSurface& result) {
  const std::size_t largest = *std::max_element(pieces.voxels.begin(), pieces.voxels.end());
  std::vector<std::int32_t> renumbered(pieces.voxels.size(), -1);
  for (std::size_t piece = 0; piece < pieces.voxels.size(); ++piece) {
    const double volume = static_cast<double>(pieces.voxels[piece]) * voxel_mm3;
    if (volume < smallest_piece_mm3 && pieces.voxels[piece] < largest) {
      ++result.dropped_pieces;
      result.dropped_volume_mm3 += volume;
    } else {
      renumbered[piece] = static_cast<std::int32_t>(result.piece_volume_mm3.size());
      result.piece_volume_mm3.push_back(volume);
    }
  }
  for (std::size_t at = 0; at < mask.in.size(); ++at) {
    if (!mask.in[at]) continue;
    pieces.number[at] = renumbered[pieces.number[at]];
    mask.in[at] = pieces.number[at] >= 0;
  }
}

vtkSmartPointer<vtkPolyData> contour(Mask& mask) {
  vtkNew<vtkImageData> data;
  data->SetDimensions(mask.size.x(), mask.size.y(), mask.size.z());
  vtkNew<vtkUnsignedCharArray> values;
  values->SetArray(mask.in.data(), static_cast<vtkIdType>(mask.in.size()), 1);
  data->GetPointData()->SetScalars(values);
  vtkNew<vtkFlyingEdges3D> edges;
  edges->SetInputData(data);
  edges->SetValue(0, 0.5);
  edges->ComputeNormalsOff();
  edges->ComputeGradientsOff();
  edges->ComputeScalarsOff();
  edges->Update();
  return edges->GetOutput();
}

// Each point sits in the middle of a grid edge: one coordinate is half-integer, and its two ends are the voxels.
void copy_points(vtkPolyData* data, const Mask& mask, const Pieces& pieces, const Eigen::Vector3d& spacing_mm,
                 VoxelSurface& result) {
  const Eigen::Index count = data->GetNumberOfPoints();
  result.surface.points.resize(count, 3);
  result.inside.resize(count, 3);
  result.outside.resize(count, 3);
  result.piece.resize(count);
  for (Eigen::Index p = 0; p < count; ++p) {
    Eigen::Vector3d at;
    data->GetPoint(p, at.data());
    Eigen::Vector3i low, high;
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<int>(std::floor(at[a] + 0.25));
      high[a] = static_cast<int>(std::floor(at[a] + 0.75));
    }
    const bool low_in = mask.in[mask.index(low.x(), low.y(), low.z())] != 0;
    const Eigen::Vector3i inside = low_in ? low : high;
    result.piece(p) = pieces.number[mask.index(inside.x(), inside.y(), inside.z())];
    result.inside.row(p) = (inside + mask.first).transpose();
    result.outside.row(p) = ((low_in ? high : low) + mask.first).transpose();
    result.surface.points.row(p) =
        (0.5 * (result.inside.row(p) + result.outside.row(p)).cast<double>()).cwiseProduct(spacing_mm.transpose());
  }
}

double signed_volume(const Surface& surface) {
  double six = 0;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0)),
                             b = surface.points.row(surface.triangles(t, 1)),
                             c = surface.points.row(surface.triangles(t, 2));
    six += a.dot(b.cross(c));
  }
  return six / 6;
}

}  // namespace

TissueSet meshed_tissues() {
  TissueSet set{};
  for (int t = 0; t < segmentation::tissue_count; ++t) set[t] = is_meshed(static_cast<segmentation::Tissue>(t));
  return set;
}

TissueSet only(segmentation::Tissue tissue) {
  TissueSet set{};
  set[static_cast<int>(tissue)] = true;
  return set;
}

VoxelSurface voxel_surface(const LabelImage& image, const TissueSet& members, double smallest_piece_mm3) {
  VoxelSurface result;
  Mask mask = mask_of(image, members);
  if (mask.in.empty()) return result;
  Pieces pieces = find_pieces(mask);
  drop_small_pieces(mask, pieces, image.grid.voxel_volume_mm3(), smallest_piece_mm3, result);
  const vtkSmartPointer<vtkPolyData> data = contour(mask);
  copy_points(data, mask, pieces, image.grid.spacing_mm, result);
  vtkCellArray* polys = data->GetPolys();
  result.surface.triangles.resize(polys->GetNumberOfCells(), 3);
  for (Eigen::Index t = 0; t < result.surface.triangles.rows(); ++t) {
    vtkIdType size = 0;
    const vtkIdType* ids = nullptr;
    polys->GetCellAtId(t, size, ids);
    for (int c = 0; c < 3; ++c) result.surface.triangles(t, c) = static_cast<int>(ids[c]);
  }
  if (signed_volume(result.surface) < 0) result.surface.triangles.col(1).swap(result.surface.triangles.col(2));
  return result;
}

Surface to_patient(Surface surface, const segmentation::Grid& grid) {
  const Points along_axes = surface.points;
  surface.points = (along_axes * grid.direction.transpose()).rowwise() + grid.origin_mm.transpose();
  if (grid.direction.determinant() < 0) surface.triangles.col(1).swap(surface.triangles.col(2));
  return surface;
}

}  // namespace supine::reconstruction
