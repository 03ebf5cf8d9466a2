// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "common/error.h"
#include "meshing/jacobian.h"
#include "meshing/quality.h"
#include "meshing/tetrahedra/fine_surface.h"
#include "meshing/tetrahedra/grade.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "meshing/topology.h"
#include "reconstruction/surface_check.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

using meshing::CurveReport;
using meshing::TetMesh;
using reconstruction::Surface;

constexpr int inner = 1, skin = 2, cut = 4;

TetMesh straight_dome(int rings) {
  const testing::DomeOptions dome{.rings = rings};
  TetMesh mesh = meshing::to_quadratic(meshing::tetrahedralise(testing::dome_surface(dome), {}));
  mesh.muscle = testing::dome_mesh(dome).muscle;
  return mesh;
}

Surface fine_dome() { return testing::dome_surface({.rings = 40}); }

meshing::MuscleDistance muscle_of(const TetMesh& mesh) {
  Eigen::Matrix<double, 2, 3> box;
  box << mesh.points.colwise().minCoeff(), mesh.points.colwise().maxCoeff();
  return {mesh.muscle, box};
}

// Boundary nodes and the regions of the faces around each.
std::map<int, std::set<int>> boundary_nodes(const TetMesh& mesh) {
  std::map<int, std::set<int>> regions;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (const int node : mesh.faces.row(f)) regions[node].insert(meshing::patch_of(mesh.region[f]));
  return regions;
}

double sampled_volume_ml(const TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    sum += meshing::curved_volume_mm3(meshing::quadratic_nodes(mesh, c)) / 1000;
  return sum;
}

TEST(Curve, DomeFollowsTheFineSurface) {
  TetMesh mesh = straight_dome(8);
  const CurveReport report = meshing::curve_boundary(mesh, fine_dome(), nullptr);
  EXPECT_LT(report.after.rms_mm, report.before.rms_mm / 4);
  EXPECT_LT(report.skin_after.rms_mm, report.skin_before.rms_mm / 4);
  EXPECT_LT(report.after.max_mm, 0.7 * report.before.max_mm);
  EXPECT_LT(std::abs(report.volume_after_ml - report.fine_volume_ml),
            std::abs(report.volume_before_ml - report.fine_volume_ml) / 5);
  EXPECT_NEAR(report.volume_after_ml, sampled_volume_ml(mesh), 1e-9);
  EXPECT_NEAR(report.fine_volume_ml, reconstruction::check_surface(fine_dome()).volume_mm3 / 1000, 1e-9);
  EXPECT_GT(report.middles, 500);
}

TEST(Curve, EveryCellKeepsTheJacobianAskedFor) {
  for (const double least : {0.2, 0.6, 0.9}) {
    TetMesh mesh = straight_dome(6);
    const CurveReport report = meshing::curve_boundary(mesh, fine_dome(), nullptr, {.least_jacobian = least});
    const auto quality = meshing::measure_quality(mesh);
    EXPECT_GE(quality.min_scaled_jacobian, least - 1e-3);
    EXPECT_EQ(quality.inverted, 0);
    if (least > 0.8) {
      EXPECT_GT(report.middles_pulled_back, 0);
      EXPECT_GT(report.pulled_back_max_mm, 0);
    }
  }
}

// Short edges where the skin ends, among long ones that bend by a good share of the short ones' length.
TEST(Curve, MeshesGradedAtTheSkinsEdgeBendSoundly) {
  const Surface coarse = testing::dome_surface({.rings = 5, .layers = 2});
  const double mean_mm = meshing::mean_edge_mm(coarse);
  for (const double share : {0.5, 0.25}) {
    const Surface graded = meshing::refine_skin_edge(coarse, share * mean_mm);
    ASSERT_GT(graded.triangles.rows(), 1.3 * coarse.triangles.rows());
    TetMesh mesh = meshing::to_quadratic(meshing::tetrahedralise(graded, {.edge_mm = mean_mm}));
    const CurveReport report = meshing::curve_boundary(mesh, fine_dome(), nullptr);
    const auto quality = meshing::measure_quality(mesh);
    EXPECT_EQ(quality.inverted, 0) << share;
    EXPECT_LT(report.skin_after.rms_mm, report.skin_before.rms_mm / 4) << share;
    EXPECT_LT(static_cast<double>(report.corners_pulled_back + report.middles_pulled_back),
              0.02 * static_cast<double>(report.corners + report.middles))
        << share;
    EXPECT_NEAR(report.volume_after_ml / report.fine_volume_ml, 1, 2e-3) << share;
  }
}

TEST(Curve, BorderNodesLieOnTheBorder) {
  const testing::DomeOptions dome;
  TetMesh mesh = straight_dome(8);
  const auto off_border = [&](int node) {  // from the circle of arc length rim_factor × foot radius on the cylinder
    const Eigen::RowVector3d p = mesh.points.row(node);
    const double lateral = dome.muscle_radius_mm * std::asin(p.x() / dome.muscle_radius_mm);
    return std::abs(std::hypot(lateral, p.z()) - dome.rim_factor * dome.foot_radius_mm);
  };
  const auto largest = [&] {
    double far = 0;
    for (const auto& [node, regions] : boundary_nodes(mesh))
      if (regions == std::set<int>{inner, cut}) far = std::max(far, off_border(node));
    return far;
  };
  const double before = largest();
  meshing::curve_boundary(mesh, fine_dome(), nullptr);
  EXPECT_GT(before, 0.15);  // chords of edges of 10 mm on a radius of 80 mm
  EXPECT_LT(largest(), 0.02);
}

TEST(Curve, InnerNodesLieOnTheMuscle) {
  TetMesh mesh = straight_dome(8);
  const auto muscle = muscle_of(mesh);
  meshing::curve_boundary(mesh, fine_dome(), &muscle, {.muscle_reach_mm = 2});
  int count = 0;
  double on_corners = 0;
  for (const auto& [node, regions] : boundary_nodes(mesh)) {
    if (!regions.contains(inner) || regions.size() > 2) continue;
    ++count;
    on_corners = std::max(on_corners, std::abs(muscle.value(mesh.points.row(node).transpose())));
  }
  EXPECT_GT(count, 300);
  EXPECT_LT(on_corners, 1e-6);
}

TEST(Curve, MuscleIsFollowedNoFurtherThanItsReach) {
  TetMesh mesh = straight_dome(6), same = mesh;
  const auto muscle = muscle_of(mesh);
  Surface lowered = mesh.muscle;  // a muscle 3 mm off the surface: another one's
  lowered.points.rowwise() += Eigen::RowVector3d(0, 3, 0);
  mesh.muscle = lowered;
  const auto off = muscle_of(mesh);
  meshing::curve_boundary(same, fine_dome(), nullptr);
  meshing::curve_boundary(mesh, fine_dome(), &off, {.muscle_reach_mm = 0.25});
  EXPECT_LT((mesh.points - same.points).rowwise().norm().maxCoeff(), 0.3);
  EXPECT_GT((mesh.points - same.points).rowwise().norm().maxCoeff(), 0.15);
}

TEST(Curve, InnerEdgesStayStraight) {
  TetMesh mesh = straight_dome(6);
  meshing::curve_boundary(mesh, fine_dome(), nullptr);
  const auto boundary = boundary_nodes(mesh);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (int e = 0; e < 6; ++e) {
      const int middle = mesh.cells(c, 4 + e);
      if (boundary.contains(middle)) continue;
      const auto [a, b] = meshing::tet_edges[e];
      const Eigen::RowVector3d ends = (mesh.points.row(mesh.cells(c, a)) + mesh.points.row(mesh.cells(c, b))) / 2;
      EXPECT_LT((mesh.points.row(middle) - ends).norm(), 1e-12);
    }
}

TEST(Curve, FlatSurfaceMovesNothing) {
  TetMesh mesh = meshing::to_quadratic(testing::box_mesh(3, 3, 2, {30, 30, 20}));
  const Points before = mesh.points;
  const Surface fine = testing::boundary_surface(testing::box_mesh(15, 15, 10, {30, 30, 20}));
  const CurveReport report = meshing::curve_boundary(mesh, fine, nullptr, {.smooth_share = 0.4});
  EXPECT_LT((mesh.points - before).rowwise().norm().maxCoeff(), 1e-9);
  EXPECT_EQ(report.middles_pulled_back, 0);
  EXPECT_LT(report.after.max_mm, 1e-9);
  EXPECT_NEAR(report.volume_after_ml, 18, 1e-9);
}

// The top of a thin plate dented so deep between its corners that straight tetrahedra would turn inside out.
TEST(Curve, DentThatWouldInvertCellsIsFollowedAsFarAsTheyBear) {
  const Eigen::Vector3d size(30, 30, 3);
  TetMesh mesh = meshing::to_quadratic(testing::box_mesh(3, 3, 1, size));
  TetMesh refined = testing::box_mesh(30, 30, 3, size);
  for (Eigen::Index p = 0; p < refined.points.rows(); ++p) {
    const double x = refined.points(p, 0), y = refined.points(p, 1);
    const double dent = std::pow(std::sin(M_PI * x / 10), 2) + std::pow(std::sin(M_PI * y / 10), 2);
    refined.points(p, 2) *= 1 - 0.45 * dent;
  }
  const Surface fine = testing::boundary_surface(refined);
  TetMesh careless = mesh;
  meshing::curve_boundary(careless, fine, nullptr, {.least_jacobian = 0.01, .smooth_share = 0});
  const CurveReport report = meshing::curve_boundary(mesh, fine, nullptr, {.least_jacobian = 0.4, .smooth_share = 0});
  EXPECT_GT(report.middles_pulled_back, 5);
  EXPECT_GT(report.pulled_back_max_mm, 0.3);
  EXPECT_GE(meshing::measure_quality(mesh).min_scaled_jacobian, 0.4 - 1e-3);
  EXPECT_LT(report.after.rms_mm, report.before.rms_mm);
  EXPECT_GE(meshing::measure_quality(careless).min_scaled_jacobian, 0.01 - 1e-3);
}

TEST(Curve, NoiseOfTheFineSurfaceIsAveraged) {
  TetMesh smooth = straight_dome(8), rough = smooth, raw = smooth;
  Surface noisy = fine_dome();
  const Points normals = noisy.points;  // any reproducible pattern of ±0.1 mm
  for (Eigen::Index p = 0; p < noisy.points.rows(); ++p)
    noisy.points(p, 1) += 0.1 * std::sin(12.9898 * static_cast<double>(p) + 78.233 * normals(p, 0));
  meshing::curve_boundary(smooth, fine_dome(), nullptr);
  meshing::curve_boundary(rough, noisy, nullptr);
  meshing::curve_boundary(raw, noisy, nullptr, {.smooth_share = 0});
  const double averaged = (rough.points - smooth.points).norm(), kept = (raw.points - smooth.points).norm();
  EXPECT_LT(averaged, 0.6 * kept);
}

TEST(Curve, RefusesWhatItCannotBend) {
  TetMesh linear = testing::box_mesh(2, 2, 2, {20, 20, 20});
  const Surface fine = testing::boundary_surface(testing::box_mesh(8, 8, 8, {20, 20, 20}));
  EXPECT_THROW(meshing::curve_boundary(linear, fine, nullptr), InputError);
  TetMesh mesh = meshing::to_quadratic(linear);
  Surface bare = fine;
  bare.region.resize(0);
  EXPECT_THROW(meshing::curve_boundary(mesh, bare, nullptr), InputError);
  Surface elsewhere = fine;
  elsewhere.points.rowwise() += Eigen::RowVector3d(500, 0, 0);
  EXPECT_THROW(meshing::curve_boundary(mesh, elsewhere, nullptr), InputError);
  for (const double bad : {0.0, 1.0, -0.5})
    EXPECT_THROW(meshing::curve_boundary(mesh, fine, nullptr, {.least_jacobian = bad}), InputError);
  EXPECT_THROW(meshing::curve_boundary(mesh, fine, nullptr, {.smooth_share = 3}), InputError);
  EXPECT_THROW(meshing::curve_boundary(mesh, fine, nullptr, {.muscle_reach_mm = -1}), InputError);
}

TEST(FineSurface, SphereBetweenItsPoints) {
  // A ball of 30 mm, triangles of about 2 mm: chords are 0.02 mm inside, the fitted quadratic comes nearer.
  TetMesh ball = testing::box_mesh(16, 16, 16, {2, 2, 2});
  for (Eigen::Index p = 0; p < ball.points.rows(); ++p) {
    const Eigen::RowVector3d q = ball.points.row(p).array() - 1;
    const double most = q.cwiseAbs().maxCoeff();
    ball.points.row(p) = most > 0 ? Eigen::RowVector3d(30 * most * q.normalized()) : q;
  }
  Surface surface = testing::boundary_surface(ball);
  surface.region.setConstant(skin);
  const meshing::FineSurface fine(surface);
  double chords = 0, fitted = 0;
  for (int i = 0; i < 200; ++i) {
    const double z = (i + 0.5) / 100 - 1, turn = 2.4 * i;
    const Eigen::Vector3d n(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
    chords = std::max(chords, std::abs(fine.on_region(31 * n, skin, 0)->norm() - 30));
    fitted = std::max(fitted, std::abs(fine.on_region(31 * n, skin, 8)->norm() - 30));
  }
  EXPECT_LT(fitted, chords);
  EXPECT_LT(fitted, 0.03);
  EXPECT_FALSE(fine.on_region(Eigen::Vector3d::Zero(), cut, 5).has_value());
  EXPECT_FALSE(fine.on_border(Eigen::Vector3d::Zero(), skin, cut, 5).has_value());
}

}  // namespace
}  // namespace supine
