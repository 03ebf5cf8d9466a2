// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/tetrahedralise.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>

#include "common/error.h"
#include "meshing/quality.h"
#include "meshing/topology.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

using reconstruction::Surface;

Surface box_surface(int n, double size, const Eigen::RowVector3d& corner = Eigen::RowVector3d::Zero()) {
  Surface s = testing::boundary_surface(testing::box_mesh(n, n, n, {size, size, size}));
  s.points.rowwise() += corner;
  return s;
}

Surface joined(const Surface& a, const Surface& b) {
  Surface out;
  out.points.resize(a.points.rows() + b.points.rows(), 3);
  out.points << a.points, b.points;
  out.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  out.triangles << a.triangles, b.triangles.array() + static_cast<int>(a.points.rows());
  out.region.resize(a.region.size() + b.region.size());
  out.region << a.region, b.region;
  return out;
}

std::string message_of(const Surface& surface, const meshing::TetrahedraliseOptions& options = {}) {
  try {
    meshing::tetrahedralise(surface, options, "coarse.vtp");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Tetrahedralise, CubeHasItsVolumeAndItsAreas) {
  const meshing::TetMesh mesh = meshing::tetrahedralise(box_surface(4, 20), {});
  const auto q = meshing::measure_quality(mesh);
  EXPECT_NEAR(q.volume_ml, 8, 1e-9 * 8);
  EXPECT_NEAR(q.area_cm2[1], 4, 1e-9);
  EXPECT_NEAR(q.area_cm2[2], 20, 1e-9);
  EXPECT_EQ(q.inverted, 0);
}

TEST(Tetrahedralise, FacesAreTheSurfacesTrianglesWithTheirRegions) {
  const Surface surface = testing::dome_surface({.rings = 6});
  const meshing::TetMesh mesh = meshing::tetrahedralise(surface, {});
  ASSERT_EQ(mesh.faces.rows(), surface.triangles.rows());
  const auto key = [](const Points& points, const auto& row) {
    std::array<std::array<double, 3>, 3> k;
    for (int i = 0; i < 3; ++i) k[i] = {points(row[i], 0), points(row[i], 1), points(row[i], 2)};
    std::rotate(k.begin(), std::min_element(k.begin(), k.end()), k.end());
    return k;
  };
  std::map<std::array<std::array<double, 3>, 3>, int> wanted;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    wanted[key(surface.points, surface.triangles.row(t))] = surface.region[t];
  }
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto found = wanted.find(key(mesh.points, mesh.faces.row(f)));
    ASSERT_NE(found, wanted.end()) << f;
    EXPECT_EQ(mesh.region[f], found->second);
  }
}

TEST(Tetrahedralise, DomeIsOfGoodQuality) {
  const auto q = meshing::measure_quality(meshing::tetrahedralise(testing::dome_surface({.rings = 10}), {}));
  EXPECT_EQ(q.inverted, 0);
  EXPECT_GT(q.min_dihedral_deg, 8);
  EXPECT_LT(q.max_dihedral_deg, 165);
  EXPECT_GT(q.mean_radius_ratio, 0.6);
}

TEST(Tetrahedralise, NumberOfCellsIsMet) {
  for (const std::size_t cells : {6000u, 12000u}) {
    const auto mesh = meshing::tetrahedralise(testing::dome_surface({.rings = 10}), {.cells = cells});
    EXPECT_NEAR(static_cast<double>(mesh.cells.rows()), static_cast<double>(cells), 0.2 * static_cast<double>(cells));
  }
}

TEST(Tetrahedralise, SameSurfaceSameMesh) {
  const Surface surface = testing::dome_surface({.rings = 5});
  const auto a = meshing::tetrahedralise(surface, {}), b = meshing::tetrahedralise(surface, {});
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.cells, b.cells);
}

TEST(Tetrahedralise, CavityStaysEmpty) {
  Surface hole = box_surface(2, 6, {7, 7, 7});
  hole.triangles.col(0).swap(hole.triangles.col(1));  // outward of the body is into the hole
  const auto mesh = meshing::tetrahedralise(joined(box_surface(4, 20), hole), {});
  EXPECT_NEAR(meshing::measure_quality(mesh).volume_ml, 8 - 0.216, 1e-9 * 8);
}

TEST(Tetrahedralise, TwoBodiesAreBothFilled) {
  const auto mesh = meshing::tetrahedralise(joined(box_surface(2, 10), box_surface(2, 10, {30, 0, 0})), {});
  EXPECT_NEAR(meshing::measure_quality(mesh).volume_ml, 2, 1e-9 * 2);
}

TEST(Tetrahedralise, RefusesAnOpenSurfaceWithPlace) {
  Surface surface = box_surface(3, 20);
  surface.triangles.conservativeResize(surface.triangles.rows() - 1, 3);
  surface.region.conservativeResize(surface.triangles.rows());
  const std::string message = message_of(surface);
  EXPECT_NE(message.find("coarse.vtp"), std::string::npos) << message;
  EXPECT_NE(message.find("mm"), std::string::npos) << message;
}

TEST(Tetrahedralise, RefusesANonManifoldSurface) {
  Surface a = box_surface(1, 10), b = box_surface(1, 10, {10, 10, 0});  // two cubes that share an edge
  Surface both = joined(a, b);
  for (Eigen::Index i = 0; i < both.triangles.size(); ++i) {
    int& p = both.triangles.data()[i];
    for (int other = 0; other < p; ++other) {
      if ((both.points.row(other) - both.points.row(p)).norm() < 1e-12) {
        p = other;
        break;
      }
    }
  }
  EXPECT_NE(message_of(both), "");
}

TEST(Tetrahedralise, RefusesASelfIntersectingSurface) {
  EXPECT_NE(message_of(joined(box_surface(2, 20), box_surface(2, 20, {10.5, 9.5, 8.5}))), "");
}

TEST(Tetrahedralise, RefusesASurfaceThatIsInsideOut) {
  Surface surface = box_surface(2, 20);
  surface.triangles.col(0).swap(surface.triangles.col(1));
  EXPECT_NE(message_of(surface), "");
}

TEST(Tetrahedralise, RefusesASurfaceWithoutRegions) {
  Surface surface = box_surface(2, 20);
  surface.region.resize(0);
  EXPECT_NE(message_of(surface).find("region"), std::string::npos);
  surface = box_surface(2, 20);
  surface.region[4] = 0;
  EXPECT_NE(message_of(surface).find("triangle 4"), std::string::npos);
}

TEST(Tetrahedralise, RefusesOptionsOutOfRange) {
  const Surface surface = box_surface(2, 20);
  EXPECT_NE(message_of(surface, {.radius_edge = 1.0}).find("radius_edge"), std::string::npos);
  EXPECT_NE(message_of(surface, {.min_dihedral_deg = 30}).find("min_dihedral_deg"), std::string::npos);
  EXPECT_NE(message_of(surface, {.cells = 3}).find("cells"), std::string::npos);
}

}  // namespace
}  // namespace supine
