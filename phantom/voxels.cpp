// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/voxels.h"

#include <algorithm>
#include <cmath>

#include "meshing/surface/triangle_tree.h"
#include "phantom/face_grid.h"
#include "phantom/random.h"
#include "reconstruction/surface.h"
#include "simulation/embedding.h"

namespace supine::phantom {
namespace {

using reconstruction::Region;
using segmentation::Grid;
using segmentation::LabelImage;

constexpr double skin_mm = 1.5, muscle_mm = 14, excluded_mm = 12, margin_mm = 18, gap_mm = 1;
constexpr int steps = 4;  // a face is cut into steps² triangles

Grid grid_around(const Points& body, double voxel_mm, Random& random) {
  Grid grid;
  grid.spacing_mm.setConstant(voxel_mm);
  for (int i = 0; i < 3; ++i) {
    // A multiple of 1/64 voxel, so that the header has few digits.
    const double lower = body.col(i).minCoeff() - margin_mm - voxel_mm * random.uniform();
    grid.origin_mm[i] = std::round(lower * 64) / 64;
    grid.size[i] = static_cast<int>(std::ceil((body.col(i).maxCoeff() + margin_mm - lower) / voxel_mm)) + 1;
  }
  return grid;
}

// Which side of the directed line a → b the point is on; the same number for b → a but for the sign, so that a point is
// inside one only of two triangles with a common edge.
bool left_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b, int ia, int ib, const Eigen::Vector2d& p) {
  const bool swapped = ia > ib;
  const Eigen::Vector2d &s = swapped ? b : a, &e = swapped ? a : b;
  const double side = (e.x() - s.x()) * (p.y() - s.y()) - (e.y() - s.y()) * (p.x() - s.x());
  return (side > 0) != swapped;
}

/// Heights (y) at which lines along y through the voxel columns (x, z) cross the closed surface.
std::vector<std::vector<double>> crossings(const Grid& grid, const Points& points, const Triangles& triangles) {
  std::vector<std::vector<double>> found(static_cast<std::size_t>(grid.size.x()) * grid.size.z());
  const auto flat = [&](int i) { return Eigen::Vector2d(points(i, 0), points(i, 2)); };
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const int ia = triangles(t, 0), ib = triangles(t, 1), ic = triangles(t, 2);
    const Eigen::Vector2d a = flat(ia), b = flat(ib), c = flat(ic);
    const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    const auto first = [&](double value, int axis) {
      return std::max(0, static_cast<int>(std::ceil((value - grid.origin_mm[axis]) / grid.spacing_mm[axis])));
    };
    for (int k = first(low.y(), 2); k < grid.size.z(); ++k) {
      const double z = grid.origin_mm.z() + k * grid.spacing_mm.z();
      if (z > high.y()) break;
      for (int i = first(low.x(), 0); i < grid.size.x(); ++i) {
        const Eigen::Vector2d p(grid.origin_mm.x() + i * grid.spacing_mm.x(), z);
        if (p.x() > high.x()) break;
        const bool ab = left_of(a, b, ia, ib, p), bc = left_of(b, c, ib, ic, p), ca = left_of(c, a, ic, ia, p);
        if (ab != bc || bc != ca) continue;
        const Eigen::Vector2d u = b - a, v = c - a, d = p - a;
        const double det = u.x() * v.y() - u.y() * v.x();
        if (det == 0) continue;
        const double s = (d.x() * v.y() - d.y() * v.x()) / det, r = (u.x() * d.y() - u.y() * d.x()) / det;
        found[i + static_cast<std::size_t>(grid.size.x()) * k].push_back(
            points(ia, 1) + s * (points(ib, 1) - points(ia, 1)) + r * (points(ic, 1) - points(ia, 1)));
      }
    }
  }
  for (auto& column : found) std::sort(column.begin(), column.end());
  return found;
}

std::vector<char> inside(const Grid& grid, const Points& points, const Triangles& triangles) {
  std::vector<char> in(grid.count(), 0);
  const auto columns = crossings(grid, points, triangles);
  for (int k = 0; k < grid.size.z(); ++k)
    for (int i = 0; i < grid.size.x(); ++i) {
      const auto& column = columns[i + static_cast<std::size_t>(grid.size.x()) * k];
      std::size_t passed = 0;
      for (int j = 0; j < grid.size.y(); ++j) {
        const double y = grid.origin_mm.y() + j * grid.spacing_mm.y();
        while (passed < column.size() && column[passed] <= y) ++passed;
        in[grid.index(i, j, k)] = passed % 2;
      }
    }
  return in;
}

meshing::TriangleTree tree_of(const Points& points, const FaceGrid& surface, Region region, bool is_region) {
  std::vector<int> rows;
  for (int t = 0; t < surface.region().size(); ++t)
    if ((surface.region()[t] == static_cast<int>(region)) == is_region) rows.push_back(t);
  return {points, Triangles(surface.triangles()(rows, Eigen::all))};
}

/// The boundary in its prone shape, ready to be asked.
struct Boundary {
  meshing::TriangleTree skin, cut, inner, not_skin;
  bool comes_off;  ///< whether the inner surface lies further off the muscle than gap_mm anywhere
};

bool behind_wall(const Boundary& boundary, const meshing::MuscleDistance& muscle, const Eigen::Vector3d& p,
                 double height) {
  const auto wall = boundary.cut.closest(p, excluded_mm);
  if (wall.triangle < 0) return false;
  const auto skin = boundary.skin.closest(p, excluded_mm);
  // Beside the upper rim of the wall skin and wall are equally near: what lies higher is air.
  if (skin.squared_mm2 < wall.squared_mm2 - 1e-6) return false;
  // The muscle falls away from the straight way out: by 12²/2R over the whole reach.
  return height <= muscle.value(wall.point) + 0.5 + wall.squared_mm2 / 200;
}

/// Between tissue that hangs off the muscle and the muscle.
bool under_tissue(const Boundary& boundary, const meshing::MuscleDistance& muscle, const Eigen::Vector3d& p,
                  double height) {
  if (!boundary.comes_off) return false;
  const auto inner = boundary.inner.closest(p);
  if (muscle.value(inner.point) <= height) return false;
  const double nearer_than = std::sqrt(inner.squared_mm2 + 1e-6);
  return boundary.skin.closest(p, nearer_than).triangle < 0 && boundary.cut.closest(p, nearer_than).triangle < 0;
}

Label outside_label(const Boundary& boundary, const meshing::MuscleDistance& muscle, const Eigen::Vector3d& p,
                    bool under_body) {
  const double height = muscle.value(p);
  if (height < -muscle_mm) return Label::air;
  if (height <= 0) return Label::muscle;
  if (behind_wall(boundary, muscle, p, height)) return Label::excluded;
  // What is left between tissue and muscle where the breast has come off.
  const bool gap = under_body && (height < gap_mm || under_tissue(boundary, muscle, p, height));
  return gap ? Label::muscle : Label::air;
}

bool comes_off(const Points& points, const FaceGrid& surface, const meshing::MuscleDistance& muscle) {
  for (int t = 0; t < surface.region().size(); ++t) {
    if (surface.region()[t] != static_cast<int>(Region::inner)) continue;
    for (const int corner : surface.triangles().row(t))
      if (muscle.value(points.row(corner).transpose()) > gap_mm) return true;
  }
  return false;
}

/// Voxels of the body as the labels have it: grown or shrunk at the skin.
void move_skin(const Grid& grid, const Boundary& boundary, double grown_mm, std::vector<char>& in) {
  if (grown_mm == 0) return;
  const char from = grown_mm > 0 ? 0 : 1;
  const double reach = std::abs(grown_mm);
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        char& voxel = in[grid.index(i, j, k)];
        if (voxel != from) continue;
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k));
        const auto skin = boundary.skin.closest(p, reach);
        if (skin.triangle < 0) continue;
        const auto other = boundary.not_skin.closest(p, reach);
        if (from == 1 || other.squared_mm2 > skin.squared_mm2 + 1e-6) voxel = 1 - from;
      }
}

/// Voxels that are not tissue.
void label_surroundings(const BodyMesh& body_mesh, const Body& body, const Boundary& boundary,
                        const std::vector<char>& in, LabelImage& labels) {
  const Grid& grid = labels.grid;
  const meshing::MuscleDistance& muscle = *body_mesh.anatomy.muscle;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t voxel = grid.index(i, j, k);
        if (in[voxel]) continue;
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k)), local = body.local(p);
        const double radii = body.in_foot_radii(local.head<2>());
        // Far above the muscle and far beside the body everything is air.
        if (local.z() - body.muscle_height(local.x(), local.y()) > body.rim_mm + 25 ||
            radii > body.reach + margin_mm / body.foot_radius_mm)
          continue;
        labels.voxels[voxel] = static_cast<std::uint8_t>(outside_label(boundary, muscle, p, radii < body.reach));
      }
}

/// Voxels of tissue, by where their material points were before the body was hung up.
void label_tissue(const BodyMesh& body_mesh, const Body& body, const Points& prone, const Boundary& boundary,
                  double skin_reach, const std::vector<char>& in, LabelImage& labels) {
  std::vector<std::size_t> tissue;
  for (std::size_t voxel = 0; voxel < in.size(); ++voxel)
    if (in[voxel]) tissue.push_back(voxel);
  const Grid& grid = labels.grid;
  const auto across = static_cast<std::size_t>(grid.size.x()), slice = across * grid.size.y();
  Points centres(static_cast<Eigen::Index>(tissue.size()), 3);
  for (std::size_t c = 0; c < tissue.size(); ++c)
    centres.row(static_cast<Eigen::Index>(c)) =
        grid.point(Eigen::Vector3d(tissue[c] % across, tissue[c] % slice / across, tissue[c] / slice)).transpose();
  meshing::TetMesh hanging = body_mesh.mesh;
  hanging.points = prone;
  const Points rest = simulation::Embedding(hanging, centres).at(body_mesh.mesh.points);
  for (std::size_t c = 0; c < tissue.size(); ++c) {
    const auto row = static_cast<Eigen::Index>(c);
    const Eigen::Vector3d p = body.local(rest.row(row).transpose());
    Label label = body.in_tumour(p) ? Label::tumour : body.in_gland(p) ? Label::gland : Label::adipose;
    if (boundary.skin.closest(centres.row(row).transpose(), skin_reach).triangle >= 0) label = Label::skin;
    labels.voxels[tissue[c]] = static_cast<std::uint8_t>(label);
  }
}

}  // namespace

LabelImage label_voxels(const BodyMesh& body_mesh, const Body& body, const Points& prone, std::uint64_t seed,
                        const VoxelOptions& options) {
  Random random(seed, "voxels");
  const FaceGrid surface(body_mesh.mesh, faces_with(body_mesh.mesh, 0), steps);
  const Points points = surface.at(prone);
  const Boundary boundary{tree_of(points, surface, Region::skin, true), tree_of(points, surface, Region::cut, true),
                          tree_of(points, surface, Region::inner, true), tree_of(points, surface, Region::skin, false),
                          comes_off(points, surface, *body_mesh.anatomy.muscle)};
  LabelImage labels;
  labels.grid = grid_around(points, options.voxel_mm, random);
  labels.voxels.assign(labels.grid.count(), 0);
  std::vector<char> in = inside(labels.grid, points, surface.triangles());
  move_skin(labels.grid, boundary, options.grown_mm, in);
  label_surroundings(body_mesh, body, boundary, in, labels);
  const double skin_reach = skin_mm - std::min(0.0, options.grown_mm);
  label_tissue(body_mesh, body, prone, boundary, skin_reach, in, labels);
  return labels;
}

}  // namespace supine::phantom
