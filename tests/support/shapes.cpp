// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/support/shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "meshing/topology.h"
#include "segmentation/tissue.h"

namespace supine::testing {
namespace {

using meshing::TetMesh;
using reconstruction::Region;
using reconstruction::Surface;
using segmentation::Tissue;

void fill_tissue(TetMesh& mesh, Tissue tissue) {
  mesh.tissue = Eigen::VectorXi::Constant(mesh.cells.rows(), static_cast<int>(tissue));
  mesh.fraction = Table::Zero(mesh.cells.rows(), segmentation::tissue_count);
  mesh.fraction.col(static_cast<int>(tissue)).setOnes();
}

// A disc of rings of 6 k triangles' points, radius 1: points (u, v) and triangles counter-clockwise.
struct Disc {
  std::vector<Eigen::Vector2d> points;
  std::vector<std::array<int, 3>> triangles;
};

Disc make_disc(int rings) {
  Disc disc;
  disc.points.emplace_back(0, 0);
  const auto first = [](int k) { return k == 0 ? 0 : 1 + 3 * k * (k - 1); };
  for (int k = 1; k <= rings; ++k) {
    for (int i = 0; i < 6 * k; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6 * k);
      disc.points.emplace_back(std::cos(angle) * k / rings, std::sin(angle) * k / rings);
    }
    const auto outer = [&](int i) { return first(k) + i % (6 * k); };
    const auto inner = [&](int i) { return k == 1 ? 0 : first(k - 1) + i % (6 * (k - 1)); };
    for (int sector = 0; sector < 6; ++sector) {
      for (int i = 0; i < k; ++i) {
        disc.triangles.push_back({inner(sector * (k - 1) + i), outer(sector * k + i), outer(sector * k + i + 1)});
        if (i + 1 < k) {
          disc.triangles.push_back(
              {inner(sector * (k - 1) + i), outer(sector * k + i + 1), inner(sector * (k - 1) + i + 1)});
        }
      }
    }
  }
  return disc;
}

// The point at height t over the muscle's arc-length coordinates (lateral, head).
Eigen::RowVector3d over_muscle(double radius, double lateral, double head, double t) {
  if (radius == 0) return {lateral, -t, head};
  const double angle = lateral / radius;
  return {(radius + t) * std::sin(angle), radius - (radius + t) * std::cos(angle), head};
}

double thickness(const DomeOptions& o, double arc_radius) {
  const double rho = arc_radius / o.foot_radius_mm;
  return o.rim_thickness_mm + (rho < 1 ? o.height_mm * std::pow(1 - rho * rho, 1.5) : 0.0);
}

Surface dome_muscle(const DomeOptions& o) {
  const Disc disc = make_disc(o.muscle_rings);
  const double reach = o.foot_radius_mm * o.rim_factor + o.muscle_margin_mm;
  Surface sheet{Points(disc.points.size(), 3), Triangles(disc.triangles.size(), 3), {}};
  for (std::size_t i = 0; i < disc.points.size(); ++i) {
    sheet.points.row(i) = over_muscle(o.muscle_radius_mm, reach * disc.points[i].x(), reach * disc.points[i].y(), 0);
  }
  for (std::size_t t = 0; t < disc.triangles.size(); ++t) {
    // (lateral, head, -y) is left-handed in (x, z, -y): x × z = -y, so counter-clockwise faces outward.
    sheet.triangles.row(t) << disc.triangles[t][0], disc.triangles[t][1], disc.triangles[t][2];
  }
  return sheet;
}

void push_tet(std::vector<std::array<int, 4>>& tets, const Points& points, std::array<int, 4> tet) {
  Indices one(1, 4);
  one << tet[0], tet[1], tet[2], tet[3];
  if (meshing::cell_volume_mm3(points, one, 0) < 0) std::swap(tet[2], tet[3]);
  tets.push_back(tet);
}

void set_cells(TetMesh& mesh, const std::vector<std::array<int, 4>>& tets) {
  mesh.cells.resize(static_cast<Eigen::Index>(tets.size()), 4);
  for (std::size_t c = 0; c < tets.size(); ++c) mesh.cells.row(c) << tets[c][0], tets[c][1], tets[c][2], tets[c][3];
}

}  // namespace

void add_boundary(TetMesh& mesh) {
  const meshing::Boundary boundary = meshing::boundary_of(mesh.cells);
  mesh.faces = boundary.faces;
  mesh.face_cell = boundary.face_cell;
  mesh.region = Eigen::VectorXi::Constant(mesh.faces.rows(), static_cast<int>(Region::skin));
}

TetMesh box_mesh(int nx, int ny, int nz, const Eigen::Vector3d& size_mm) {
  TetMesh mesh;
  const auto node = [&](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  mesh.points.resize((nx + 1) * (ny + 1) * (nz + 1), 3);
  std::vector<std::array<int, 4>> tets;
  for (int k = 0; k <= nz; ++k) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        mesh.points.row(node(i, j, k)) << size_mm.x() * i / nx, size_mm.y() * j / ny, size_mm.z() * k / nz;
      }
    }
  }
  constexpr int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        for (const auto& order : orders) {  // Kuhn: one tetrahedron per path along the cube's edges
          Eigen::Vector3i at(i, j, k);
          std::array<int, 4> tet{node(i, j, k)};
          for (int s = 0; s < 3; ++s) {
            ++at[order[s]];
            tet[s + 1] = node(at.x(), at.y(), at.z());
          }
          push_tet(tets, mesh.points, tet);
        }
      }
    }
  }
  set_cells(mesh, tets);
  fill_tissue(mesh, Tissue::adipose);
  add_boundary(mesh);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if ((mesh.points(mesh.faces.row(f), 2).array() == 0).all()) mesh.region[f] = static_cast<int>(Region::inner);
  }
  const int grid = 20;
  mesh.muscle.points.resize((grid + 1) * (grid + 1), 3);
  mesh.muscle.triangles.resize(2 * grid * grid, 3);
  for (int j = 0; j <= grid; ++j) {
    for (int i = 0; i <= grid; ++i) {
      mesh.muscle.points.row(i + (grid + 1) * j) << -20 + (size_mm.x() + 40) * i / grid,
          -20 + (size_mm.y() + 40) * j / grid, 0;
      if (i == grid || j == grid) continue;
      const int a = i + (grid + 1) * j, b = a + 1, c = a + grid + 1, d = c + 1;
      mesh.muscle.triangles.row(2 * (i + grid * j)) << a, b, d;
      mesh.muscle.triangles.row(2 * (i + grid * j) + 1) << a, d, c;
    }
  }
  return mesh;
}

TetMesh dome_mesh(const DomeOptions& o) {
  const Disc disc = make_disc(o.rings);
  const int columns = static_cast<int>(disc.points.size());
  const double reach = o.foot_radius_mm * o.rim_factor;
  TetMesh mesh;
  mesh.points.resize(columns * (o.layers + 1), 3);
  for (int c = 0; c < columns; ++c) {
    const Eigen::Vector2d s = reach * disc.points[c];
    for (int l = 0; l <= o.layers; ++l) {
      mesh.points.row(c + columns * l) =
          over_muscle(o.muscle_radius_mm, s.x(), s.y(), thickness(o, s.norm()) * l / o.layers);
    }
  }
  std::vector<std::array<int, 4>> tets;
  for (int l = 0; l < o.layers; ++l) {
    for (auto t : disc.triangles) {
      std::sort(t.begin(), t.end());  // the diagonal of a prism's side runs from the lower column's bottom
      const auto low = [&](int i) { return t[i] + columns * l; };
      const auto up = [&](int i) { return t[i] + columns * (l + 1); };
      push_tet(tets, mesh.points, {low(0), low(1), low(2), up(2)});
      push_tet(tets, mesh.points, {low(0), low(1), up(1), up(2)});
      push_tet(tets, mesh.points, {low(0), up(0), up(1), up(2)});
    }
  }
  set_cells(mesh, tets);
  fill_tissue(mesh, Tissue::adipose);
  add_boundary(mesh);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::RowVector3i nodes = mesh.faces.row(f);
    const bool bottom = (nodes.array() < columns).all(), top = (nodes.array() >= columns * o.layers).all();
    mesh.region[f] = static_cast<int>(bottom ? Region::inner : top ? Region::skin : Region::cut);
  }
  mesh.muscle = dome_muscle(o);
  return mesh;
}

Surface dome_surface(const DomeOptions& options) { return boundary_surface(dome_mesh(options)); }

Surface boundary_surface(const TetMesh& mesh) {
  Surface surface;
  std::map<int, int> number;
  surface.triangles.resize(mesh.faces.rows(), 3);
  std::vector<int> used;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto [entry, is_new] = number.try_emplace(mesh.faces(f, k), static_cast<int>(used.size()));
      if (is_new) used.push_back(mesh.faces(f, k));
      surface.triangles(f, k) = entry->second;
    }
  }
  surface.points = mesh.points(used, Eigen::all);
  surface.region = mesh.region;
  return surface;
}

TetMesh moved(TetMesh mesh, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& shift_mm) {
  const auto move = [&](Points& points) {
    points = ((points * rotation.transpose()).rowwise() + shift_mm.transpose()).eval();
  };
  move(mesh.points);
  move(mesh.muscle.points);
  return mesh;
}

}  // namespace supine::testing
