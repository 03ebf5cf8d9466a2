// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/handles.h"

#include <algorithm>
#include <map>

#include "reconstruction/surface_check.h"
#include "reconstruction/voxel_surface.h"
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

// Balls of the 6, 18 and 26 neighbours of a voxel, and of two voxels; then in mm, so that finer voxels of the same body
// say the same.
constexpr double radii_voxels[] = {1.0, 1.5, 1.8, 2.3};
constexpr double growth = 1.4;

enum class Change { fill, remove };

bool meshed(std::uint8_t label) { return is_meshed(static_cast<Tissue>(label)); }

SurfaceReport report_of(const LabelImage& image) {
  return check_surface(voxel_surface(image, meshed_tissues()).surface);
}

// A piece of what opening or closing changes.
struct Piece {
  Eigen::Vector3i low = Eigen::Vector3i::Constant(1 << 30), high = Eigen::Vector3i::Constant(-1);
  std::vector<Eigen::Vector3i> voxels;
};

// A ball in the unit of a grid.
struct Ball {
  Grid grid;
  double radius;
};

/// The balls that are tried, smallest first.
std::vector<Ball> balls_for(const Grid& grid) {
  std::vector<Ball> balls;
  Grid voxels = grid;
  voxels.spacing_mm.setOnes();
  for (const double radius : radii_voxels) balls.push_back({voxels, radius});
  const double tried_mm = balls.back().radius * grid.spacing_mm.minCoeff();
  for (double radius = growth * tried_mm; radius < growth * largest_ball_mm; radius *= growth)
    if (tried_mm < largest_ball_mm) balls.push_back({grid, std::min(radius, largest_ball_mm)});
  return balls;
}

std::vector<Piece> changed_pieces(const LabelImage& image, Change change, const Ball& ball) {
  const auto& [voxels, radius] = ball;
  const Mask before = meshed_mask(image);
  const bool fill = change == Change::fill;
  const Mask after = fill ? segmentation::erode(segmentation::dilate(before, voxels, radius), voxels, radius)
                          : segmentation::dilate(segmentation::erode(before, voxels, radius), voxels, radius);
  Mask changed(before.size());
  for (std::size_t v = 0; v < changed.size(); ++v) changed[v] = fill ? after[v] && !before[v] : before[v] && !after[v];
  const segmentation::Components components = segmentation::connected_components(changed, voxels);
  std::vector<Piece> pieces(components.size.size());
  for (int k = 0; k < voxels.size.z(); ++k)
    for (int j = 0; j < voxels.size.y(); ++j)
      for (int i = 0; i < voxels.size.x(); ++i) {
        const std::size_t v = voxels.index(i, j, k);
        if (!changed[v]) continue;
        Piece& piece = pieces[components.number[v] - 1];
        const Eigen::Vector3i at(i, j, k);
        piece.low = piece.low.cwiseMin(at);
        piece.high = piece.high.cwiseMax(at);
        piece.voxels.push_back(at);
      }
  return pieces;
}

LabelImage around(const LabelImage& image, const Piece& piece) {
  constexpr int margin = 2;
  const Eigen::Vector3i low = (piece.low.array() - margin).max(0),
                        high = (piece.high.array() + margin).min(image.grid.size.array() - 1);
  LabelImage part;
  part.grid = image.grid;
  part.grid.size = high - low + Eigen::Vector3i::Ones();
  part.voxels.resize(part.grid.count());
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i)
        part.voxels[part.grid.index(i - low.x(), j - low.y(), k - low.z())] = image.at(i, j, k);
  return part;
}

// The label most of the voxels around @p at have that is meshed, or that is not; −1 when there is none.
int label_around(const LabelImage& image, const Eigen::Vector3i& at, bool wanted) {
  std::map<int, int> counts;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const Eigen::Vector3i to = at + Eigen::Vector3i(i, j, k);
        if (!image.grid.contains(to.x(), to.y(), to.z())) continue;
        const std::uint8_t label = image.at(to.x(), to.y(), to.z());
        if (meshed(label) == wanted) ++counts[label];
      }
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](auto& a, auto& b) { return a.second < b.second; });
  return most == counts.end() ? -1 : most->first;
}

// From the piece's rim inward, each voxel as those around it. @return the labels before, in the order of the piece
std::vector<std::uint8_t> repaint(LabelImage& image, const Piece& piece, Change change) {
  const auto label_at = [&image](const Eigen::Vector3i& v) -> std::uint8_t& {
    return image.voxels[image.grid.index(v.x(), v.y(), v.z())];
  };
  std::vector<std::uint8_t> before;
  for (const Eigen::Vector3i& v : piece.voxels) before.push_back(label_at(v));
  const bool wanted = change == Change::fill;
  for (bool painted = true; painted;) {
    std::vector<std::pair<Eigen::Vector3i, int>> layer;
    for (const Eigen::Vector3i& v : piece.voxels)
      if (meshed(label_at(v)) != wanted)
        if (const int label = label_around(image, v, wanted); label >= 0) layer.emplace_back(v, label);
    for (const auto& [v, label] : layer) label_at(v) = static_cast<std::uint8_t>(label);
    painted = !layer.empty();
  }
  return before;
}

std::size_t pieces_of(const LabelImage& image) {
  return segmentation::connected_components(meshed_mask(image), image.grid).size.size();
}

// Whether the change closed a handle; otherwise the image is as it was.
bool closes_handle(LabelImage& image, const Piece& piece, Change change) {
  const SurfaceReport before = report_of(around(image, piece));
  const std::vector<std::uint8_t> labels = repaint(image, piece, change);
  const SurfaceReport after = report_of(around(image, piece));
  bool closed = after.euler > before.euler;
  if (closed && change == Change::fill) closed = after.components <= before.components;  // no cavity
  const auto put_back = [&] {
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const Eigen::Vector3i& v = piece.voxels[i];
      image.voxels[image.grid.index(v.x(), v.y(), v.z())] = labels[i];
    }
  };
  if (closed && change == Change::remove) {
    const std::size_t now = pieces_of(image);
    const LabelImage removed = image;
    put_back();
    closed = now <= pieces_of(image);
    if (closed) image = removed;
  }
  if (!closed) put_back();
  return closed;
}

void try_changes(LabelImage& image, Change change, const Ball& ball, HandleRepair& repair) {
  for (const Piece& piece : changed_pieces(image, change, ball)) {
    if (!closes_handle(image, piece, change)) continue;
    const double volume_mm3 = static_cast<double>(piece.voxels.size()) * image.grid.voxel_volume_mm3();
    (change == Change::fill ? repair.filled_mm3 : repair.removed_mm3) += volume_mm3;
    repair.places_mm.push_back(image.grid.point(0.5 * (piece.low + piece.high).cast<double>()));
  }
}

}  // namespace

HandleRepair close_handles(LabelImage& image) {
  HandleRepair repair;
  repair.genus = repair.genus_before = report_of(image).genus();
  if (repair.genus == 0) return repair;
  for (const Ball& ball : balls_for(image.grid))
    for (const Change change : {Change::fill, Change::remove}) {
      if (repair.genus == 0) return repair;
      try_changes(image, change, ball, repair);
      repair.genus = report_of(image).genus();
    }
  return repair;
}

}  // namespace supine::reconstruction
