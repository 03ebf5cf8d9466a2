// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/tetrahedralise.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "common/error.h"
#include "meshing/surface/sound_surface.h"
#include "meshing/tetrahedra/improve.h"
#include "meshing/tetrahedra/tetgen_call.h"
#include "meshing/topology.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;

using Corners = std::array<int, 3>;

// Corners with the smallest first, in the same cyclic order.
Corners turned(Corners t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

std::map<Corners, int> triangle_numbers(const Surface& surface) {
  std::map<Corners, int> numbers;
  for (int t = 0; t < surface.triangles.rows(); ++t) {
    numbers[turned({surface.triangles(t, 0), surface.triangles(t, 1), surface.triangles(t, 2)})] = t;
  }
  return numbers;
}

// Cells on the inner side of the surface; those of its cavities, which see triangles from behind, are dropped.
Indices inside_cells(const TetgenResult& filled, const std::map<Corners, int>& triangles) {
  std::set<int> outside;
  for (Eigen::Index c = 0; c < filled.cells.rows(); ++c) {
    for (const auto& face : tet_faces) {
      const Corners behind = {filled.cells(c, face[0]), filled.cells(c, face[2]), filled.cells(c, face[1])};
      if (triangles.contains(turned(behind))) outside.insert(filled.chamber[c]);
    }
  }
  std::vector<int> kept;
  for (Eigen::Index c = 0; c < filled.cells.rows(); ++c) {
    if (!outside.contains(filled.chamber[c])) kept.push_back(static_cast<int>(c));
  }
  return filled.cells(kept, Eigen::all);
}

TetMesh assemble(const TetgenResult& filled, const Surface& surface) {
  const std::map<Corners, int> triangles = triangle_numbers(surface);
  TetMesh mesh;
  mesh.points = filled.points;
  mesh.cells = inside_cells(filled, triangles);
  const Boundary boundary = boundary_of(mesh.cells);
  mesh.faces = boundary.faces;
  mesh.face_cell = boundary.face_cell;
  mesh.region.resize(mesh.faces.rows());
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto found = triangles.find(turned({mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2)}));
    if (found == triangles.end()) {
      const Eigen::RowVector3d p = mesh.points.row(mesh.faces(f, 0));
      throw NumericalFailure(
          fmt::format("TetGen left a boundary triangle that the surface does not have, near ({:.2f}, {:.2f}, "
                      "{:.2f}) mm",
                      p.x(), p.y(), p.z()));
    }
    mesh.region[f] = surface.region[found->second];
  }
  if (mesh.faces.rows() != surface.triangles.rows()) {
    throw NumericalFailure(
        fmt::format("TetGen kept {} of the surface's {} triangles", mesh.faces.rows(), surface.triangles.rows()));
  }
  return mesh;
}

void drop_unused_points(TetMesh& mesh, Triangles& walls) {
  std::vector<int> number(mesh.points.rows(), -1), used;
  for (Eigen::Index i = 0; i < mesh.cells.size(); ++i) number[mesh.cells.data()[i]] = 0;
  for (int p = 0; p < mesh.points.rows(); ++p) {
    if (number[p] < 0) continue;
    number[p] = static_cast<int>(used.size());
    used.push_back(p);
  }
  if (static_cast<Eigen::Index>(used.size()) == mesh.points.rows()) return;
  mesh.points = Points(mesh.points(used, Eigen::all));
  for (Indices* rows : {&mesh.cells, &mesh.faces}) {
    for (Eigen::Index i = 0; i < rows->size(); ++i) rows->data()[i] = number[rows->data()[i]];
  }
  for (Eigen::Index i = 0; i < walls.size(); ++i) walls.data()[i] = number[walls.data()[i]];
}

// TetGen promises to keep all triangles; those inside are no faces of the mesh, so that assemble() does not see them.
void require_walls(const TetMesh& mesh, const Triangles& walls) {
  std::set<Corners> faces;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (const auto& f : tet_faces)
      faces.insert(turned({mesh.cells(c, f[0]), mesh.cells(c, f[1]), mesh.cells(c, f[2])}));
  for (Eigen::Index t = 0; t < walls.rows(); ++t) {
    if (faces.contains(turned({walls(t, 0), walls(t, 1), walls(t, 2)}))) continue;
    const Eigen::RowVector3d p = mesh.points.row(walls(t, 0));
    throw NumericalFailure(fmt::format(
        "TetGen did not keep a triangle of an interface near ({:.2f}, {:.2f}, {:.2f}) mm", p.x(), p.y(), p.z()));
  }
}

SizeField scaled(const SizeField& sizes, double factor) {
  SizeField result = sizes;
  result.size_mm *= factor;
  return result;
}

// TetGen's filling with about so many cells, of several tries the nearest.
TetgenResult filled_to_count(const Surface& all, const Inside& inside, const TetrahedraliseOptions& options,
                             double volume_mm3, double edge_mm) {
  // A bound on the volume gives cells of a little over half of it on average; a regular tetrahedron has edge³ / (6 √2).
  const double regular = edge_mm * edge_mm * edge_mm / (6 * std::sqrt(2.0));
  double bound = options.cells == 0 ? 1.7 * regular : 1.7 * volume_mm3 / static_cast<double>(options.cells);
  if (inside.sizes) bound = volume_mm3;  // the sizes alone decide
  double factor = 1, best_miss = 1e300;
  TetgenResult filled;
  for (int pass = 0; pass < (options.cells == 0 ? 1 : 4); ++pass) {
    std::optional<SizeField> sizes;
    if (inside.sizes) sizes = scaled(*inside.sizes, factor);
    TetgenResult tried =
        call_tetgen(all, {options.radius_edge, options.min_dihedral_deg, bound}, sizes ? &*sizes : nullptr);
    const double ratio =
        options.cells == 0 ? 1 : static_cast<double>(tried.cells.rows()) / static_cast<double>(options.cells);
    const double miss = std::abs(std::log(ratio));
    if (miss < best_miss) {
      best_miss = miss;
      filled = std::move(tried);
    }
    if (best_miss < 0.05) break;
    (inside.sizes ? factor : bound) *= std::pow(ratio, inside.sizes ? 0.4 : 1.2);
  }
  return filled;
}

void check_input(const Surface& surface, const std::string& what) {
  if (surface.region.size() != surface.triangles.rows()) {
    throw InputError(
        fmt::format("{} carries no regions; the cell array \"region\" (inner 1, skin 2, cut 4) is needed", what));
  }
  for (Eigen::Index t = 0; t < surface.region.size(); ++t) {
    if (surface.region[t] >= 1 && surface.region[t] <= 4) continue;
    const Eigen::RowVector3d p = surface.points.row(surface.triangles(t, 0));
    throw InputError(fmt::format(
        "{}: triangle {} at ({:.2f}, {:.2f}, {:.2f}) mm has region {}; inner 1, skin 2, ligament 3 or cut 4 "
        "is expected",
        what, t, p.x(), p.y(), p.z(), surface.region[t]));
  }
  require_sound(surface, Borders::closed, what);
}

}  // namespace

void TetrahedraliseOptions::check() const {
  if (!(radius_edge >= 1.2 && radius_edge <= 3)) {
    throw InputError(fmt::format("radius_edge is {}; it must lie in [1.2, 3]", radius_edge));
  }
  if (!(min_dihedral_deg >= 0 && min_dihedral_deg <= 18)) {
    throw InputError(fmt::format("min_dihedral_deg is {}; it must lie in [0, 18]", min_dihedral_deg));
  }
  if (!(edge_mm >= 0)) throw InputError(fmt::format("edge_mm is {}; it must be >= 0", edge_mm));
  constexpr std::size_t most_cells = 20'000'000;
  if (cells != 0 && (cells < 10 || cells > most_cells))
    throw InputError(fmt::format("cells is {}; it must lie in [10, {}]", cells, most_cells));
}

double mean_edge_mm(const Surface& surface) {
  double sum = 0;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    for (int k = 0; k < 3; ++k) {
      sum +=
          (surface.points.row(surface.triangles(t, k)) - surface.points.row(surface.triangles(t, (k + 1) % 3))).norm();
    }
  }
  return sum / (3.0 * static_cast<double>(surface.triangles.rows()));
}

TetMesh tetrahedralise(const Surface& surface, const TetrahedraliseOptions& options, const std::string& what) {
  return tetrahedralise(surface, Inside{}, options, what).mesh;
}

FilledMesh tetrahedralise(const Surface& surface, const Inside& inside, const TetrahedraliseOptions& options,
                          const std::string& what) {
  options.check();
  check_input(surface, what);
  const Surface all = inside.interfaces.empty() ? surface : with_interfaces(surface, inside.interfaces, what);
  const double volume = reconstruction::check_surface(surface).volume_mm3;
  const double edge = options.edge_mm > 0 ? options.edge_mm : mean_edge_mm(surface);
  FilledMesh result;
  result.mesh = assemble(filled_to_count(all, inside, options, volume, edge), surface);
  Triangles walls = all.triangles.bottomRows(all.triangles.rows() - surface.triangles.rows());
  drop_unused_points(result.mesh, walls);
  require_walls(result.mesh, walls);
  move_points(result.mesh, 20, walls);
  if (insert_points(result.mesh, 16, walls) > 0) move_points(result.mesh, 20, walls);
  result.enclosing = enclosing_interfaces(result.mesh, walls, inside.interfaces);
  return result;
}

}  // namespace supine::meshing
