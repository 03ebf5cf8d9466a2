// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/body_mesh.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "meshing/tetrahedra/tetrahedralise.h"
#include "meshing/topology.h"
#include "phantom/random.h"
#include "segmentation/tissue.h"
#include "simulation/mechanics.h"

namespace supine::phantom {
namespace {

using reconstruction::Region;
using reconstruction::Surface;
using segmentation::Tissue;

// The skin's end on the wall sets how far the body slides: edges are short there (docs/supine-phantom.md).
constexpr int wall_layers = 4;
constexpr double crowding = 0.5;  // of the rings toward the rim: the last is half as wide as the mean
constexpr double sheet_margin_mm = 45, sheet_spacing_mm = 4;
constexpr double least_det = 0.3;  // of a bent cell against its straight one

/// A surface point in the coordinates of Body::place.
struct Place {
  Eigen::Vector2d disc;
  double share;
};

struct Patches {
  std::vector<Place> places;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<int> region;

  void add(int a, int b, int c, Region which) {
    triangles.emplace_back(a, b, c);
    region.push_back(static_cast<int>(which));
  }
};

// Ring k of 6 k points; point j of ring k, rows wrap round.
int ring_point(int k, int j) { return k == 0 ? 0 : 1 + 3 * k * (k - 1) + j % (6 * k); }

std::vector<Eigen::Vector2d> disc_points(int rings, Random& random) {
  std::vector<Eigen::Vector2d> points = {{0, 0}};
  const double turn = random.uniform(0, 1);
  for (int k = 1; k <= rings; ++k)
    for (int j = 0; j < 6 * k; ++j) {
      // The rim stays a circle; inside, points are shaken so that the mesh follows nothing.
      const double share = static_cast<double>(k) / rings, width = (1 + crowding * (1 - 2 * share)) / rings;
      const double shake = k == rings ? 0 : 0.18 * width;
      const double angle = 2 * std::numbers::pi * (j + turn) / (6 * k);
      const double radius = share + crowding * share * (1 - share);
      points.emplace_back(radius * std::cos(angle) + shake * random.uniform(-1, 1),
                          radius * std::sin(angle) + shake * random.uniform(-1, 1));
    }
  return points;
}

void add_disc(Patches& patches, int first, int rings, bool upward, Region region) {
  const auto add = [&](int a, int b, int c) {
    upward ? patches.add(first + a, first + b, first + c, region)
           : patches.add(first + a, first + c, first + b, region);
  };
  for (int k = 1; k <= rings; ++k)
    for (int sector = 0; sector < 6; ++sector)
      for (int j = 0; j < k; ++j) {
        const int outer = sector * k + j, inner = sector * (k - 1) + j;
        add(ring_point(k - 1, inner), ring_point(k, outer), ring_point(k, outer + 1));
        if (j < k - 1) add(ring_point(k - 1, inner), ring_point(k, outer + 1), ring_point(k - 1, inner + 1));
      }
}

Patches body_patches(int rings, Random& random) {
  Patches patches;
  const std::vector<Eigen::Vector2d> disc = disc_points(rings, random);
  const int count = static_cast<int>(disc.size()), around = 6 * rings;
  for (const auto& p : disc) patches.places.push_back({p, 1});
  for (const auto& p : disc) patches.places.push_back({p, 0});
  for (int layer = 1; layer < wall_layers; ++layer)
    for (int j = 0; j < around; ++j)
      patches.places.push_back({disc[ring_point(rings, j)], static_cast<double>(layer) / wall_layers});
  add_disc(patches, 0, rings, true, Region::skin);
  add_disc(patches, count, rings, false, Region::inner);
  const auto wall_point = [&](int layer, int j) {
    if (layer == 0) return count + ring_point(rings, j);
    if (layer == wall_layers) return ring_point(rings, j);
    return 2 * count + (layer - 1) * around + j % around;
  };
  for (int layer = 0; layer < wall_layers; ++layer)
    for (int j = 0; j < around; ++j) {
      patches.add(wall_point(layer, j), wall_point(layer, j + 1), wall_point(layer + 1, j + 1), Region::cut);
      patches.add(wall_point(layer, j), wall_point(layer + 1, j + 1), wall_point(layer + 1, j), Region::cut);
    }
  return patches;
}

Surface surface_of(const Body& body, const Patches& patches) {
  Surface surface;
  surface.points.resize(static_cast<Eigen::Index>(patches.places.size()), 3);
  for (std::size_t i = 0; i < patches.places.size(); ++i)
    surface.points.row(static_cast<Eigen::Index>(i)) =
        body.world(body.place(patches.places[i].disc, patches.places[i].share)).transpose();
  const bool mirrored = body.frame().determinant() < 0;
  const auto count = static_cast<Eigen::Index>(patches.triangles.size());
  surface.triangles.resize(count, 3);
  surface.region.resize(count);
  for (Eigen::Index t = 0; t < count; ++t) {
    Eigen::Vector3i corners = patches.triangles[t];
    if (mirrored) std::swap(corners[1], corners[2]);
    surface.triangles.row(t) = corners.transpose();
    surface.region[t] = patches.region[t];
  }
  return surface;
}

// The formula's place of the middle of an edge between two surface points of one patch.
Eigen::RowVector3d curved_midpoint(const Body& body, const Place& a, const Place& b) {
  Eigen::Vector2d disc = 0.5 * (a.disc + b.disc);
  constexpr double rim = 1 - 1e-9;
  if (a.disc.norm() > rim && b.disc.norm() > rim) disc.normalize();
  return body.world(body.place(disc, 0.5 * (a.share + b.share))).transpose();
}

// Middles of boundary edges go onto the formulas; those of cells that this would crush go back.
void bend(meshing::TetMesh& mesh, const Body& body, const Patches& patches) {
  const Points straight = mesh.points;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int e = 0; e < 3; ++e)
      mesh.points.row(mesh.faces(f, 3 + e)) =
          curved_midpoint(body, patches.places[mesh.faces(f, e)], patches.places[mesh.faces(f, (e + 1) % 3)]);
  for (int round = 0; round < 10; ++round) {
    const Eigen::VectorXd det = simulation::cell_det_f(mesh.cells, mesh.points, straight);
    if (det.minCoeff() >= least_det) return;
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
      if (det[c] < least_det)
        for (int a = 4; a < 10; ++a) mesh.points.row(mesh.cells(c, a)) = straight.row(mesh.cells(c, a));
  }
}

// Shares of the tissues from 35 evenly spread points of each straight-sided cell.
void fill_tissue(meshing::TetMesh& mesh, const Body& body) {
  constexpr int steps = 4;
  mesh.fraction = Table::Zero(mesh.cells.rows(), segmentation::tissue_count);
  mesh.tissue.resize(mesh.cells.rows());
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    int points = 0;
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j)
        for (int k = 0; i + j + k <= steps; ++k, ++points) {
          const Eigen::Vector4d weight = (Eigen::Vector4d(i, j, k, steps - i - j - k).array() + 0.25) / (steps + 1.0);
          Eigen::Vector3d p = Eigen::Vector3d::Zero();
          for (int a = 0; a < 4; ++a) p += weight[a] * mesh.points.row(mesh.cells(c, a)).transpose();
          p = body.local(p);
          const Tissue tissue = body.in_tumour(p) ? Tissue::tumour : body.in_gland(p) ? Tissue::gland : Tissue::adipose;
          mesh.fraction(c, static_cast<int>(tissue)) += 1;
        }
    mesh.fraction.row(c) /= points;
    mesh.fraction.row(c).maxCoeff(&mesh.tissue[c]);
  }
}

Surface muscle_sheet(const Body& body) {
  const double half = 1.1 * body.reach * body.foot_radius_mm + sheet_margin_mm;
  const int steps = static_cast<int>(std::ceil(2 * half / sheet_spacing_mm));
  const auto number = [steps](int i, int j) { return i * (steps + 1) + j; };
  Surface sheet;
  sheet.points.resize((steps + 1) * (steps + 1), 3);
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j) {
      const double u = half * (2.0 * i / steps - 1), v = half * (2.0 * j / steps - 1);
      sheet.points.row(number(i, j)) = body.world({u, v, body.muscle_height(u, v)}).transpose();
    }
  const bool mirrored = body.frame().determinant() < 0;
  sheet.triangles.resize(2 * steps * steps, 3);
  for (int i = 0, t = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const int a = number(i, j), b = number(i + 1, j), c = number(i + 1, j + 1), d = number(i, j + 1);
      for (const Eigen::Vector3i& corners : {Eigen::Vector3i(a, b, c), Eigen::Vector3i(a, c, d)})
        sheet.triangles.row(t++) << corners[0], corners[mirrored ? 2 : 1], corners[mirrored ? 1 : 2];
    }
  return sheet;
}

meshing::Anatomy anatomy_of(const Body& body, const meshing::TetMesh& mesh) {
  meshing::Anatomy anatomy;
  anatomy.side = body.side;
  const Eigen::Matrix3d frame = body.frame();
  anatomy.lateral = frame.col(0);
  anatomy.head = frame.col(1);
  anatomy.outward = frame.col(2);
  anatomy.foot_centre_mm = body.centre_mm;
  anatomy.foot_radius_mm = body.foot_radius_mm;
  anatomy.foot_fourier = Eigen::VectorXd::Constant(1, body.foot_radius_mm);
  anatomy.rim_thickness_mm = body.rim_mm;
  anatomy.mound_height_mm = body.height_mm;
  Eigen::Matrix<double, 2, 3> reach;
  reach << mesh.points.colwise().minCoeff().array() - 30, mesh.points.colwise().maxCoeff().array() + 30;
  const auto muscle = std::make_shared<meshing::MuscleDistance>(mesh.muscle, reach);
  anatomy.muscle = muscle;
  const Eigen::Index count = mesh.points.rows();
  anatomy.q.resize(count, 2);
  anatomy.muscle_normal.resize(count, 3);
  anatomy.thickness_mm.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d p = mesh.points.row(i).transpose();
    const meshing::MuscleDistance::Sample sample = muscle->at(p);
    anatomy.q.row(i) = body.local(p).head<2>().transpose() / body.foot_radius_mm;
    anatomy.muscle_normal.row(i) = sample.gradient.normalized().transpose();
    anatomy.thickness_mm[i] = sample.value_mm;
  }
  return anatomy;
}

}  // namespace

BodyMesh mesh_body(const Body& body, std::uint64_t seed, int rings, int order) {
  Random random(seed, "mesh");
  const Patches patches = body_patches(rings, random);
  BodyMesh result;
  result.mesh = meshing::tetrahedralise(surface_of(body, patches), {}, "the phantom's surface");
  fill_tissue(result.mesh, body);
  if (order == 2) {
    result.mesh = meshing::to_quadratic(result.mesh);
    bend(result.mesh, body, patches);
  }
  result.mesh.muscle = muscle_sheet(body);
  result.anatomy = anatomy_of(body, result.mesh);
  return result;
}

}  // namespace supine::phantom
