// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/signed_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>

#include "common/error.h"
#include "tests/calibration/shapes.h"

namespace supine::calibration {
namespace {

const double pi = std::numbers::pi;

ModelSkin skin_of(const reconstruction::Surface& surface) { return {surface.points, surface.triangles}; }

// Order at which the remainder of f's linearisation shrinks as h halves: 2 for the right derivative. Over all halvings
// at once, because the second derivative of a distance jumps where the closest point passes an edge.
template <class F>
double taylor_order(const F& f, double slope, double h = 2e-3) {
  const int halvings = 5;
  const double f0 = f(0);
  const auto remainder = [&](double s) { return std::abs(f(s) - f0 - s * slope); };
  return std::log2(remainder(h) / remainder(std::ldexp(h, -halvings))) / halvings;
}

}  // namespace

TEST(ScanToModel, PositiveWhereTheScanLiesOutsideTheModel) {
  const ModelSkin model = skin_of(testing::sphere(50, 3));
  const Eigen::Vector3d shift(4, 0, 0);
  const auto scan = testing::sphere(50, 3, shift);
  SignedDistances distances;
  scan_to_model(model, scan.points, distances);
  for (int i = 0; i < scan.points.rows(); ++i) {
    const double exact = scan.points.row(i).norm() - 50;
    ASSERT_NEAR(distances.distance_mm[i], exact, 0.3);  // facets of a 50 mm sphere at 7.5 mm: sagitta 0.14
    if (std::abs(exact) > 0.3) {
      ASSERT_EQ(distances.distance_mm[i] > 0, exact > 0);
    }
  }
}

TEST(ModelToScan, PositiveWhereTheScanLiesOutsideTheModelWhateverTheScansOrientation) {
  const ModelSkin model = skin_of(testing::sphere(50, 3));
  for (const double radius : {47.0, 53.0}) {
    for (const bool turned : {false, true}) {
      auto surface = testing::sphere(radius, 3);
      if (turned) surface.triangles.col(1).swap(surface.triangles.col(2));
      ModelToScan result;
      model_to_scan(Scan(surface, model), model.node_points(), model.node_normals(), {}, result);
      EXPECT_TRUE(result.covered.all());
      EXPECT_NEAR(result.to_scan.distance_mm.mean(), radius - 50, 0.2);
      EXPECT_GT((result.to_scan.distance_mm * (radius - 50)).minCoeff(), 0);
    }
  }
}

TEST(ModelToScan, HalfTurnedTrianglesAndBarePointsSayTheSame) {
  const ModelSkin model = skin_of(testing::sphere(50, 3));
  const auto surface = testing::sphere(52, 4);
  auto mixed = surface;
  for (int t = 0; t < mixed.triangles.rows(); t += 2) std::swap(mixed.triangles(t, 1), mixed.triangles(t, 2));
  ModelToScan straight, turned, bare;
  model_to_scan(Scan(surface, model), model.node_points(), model.node_normals(), {}, straight);
  model_to_scan(Scan(mixed, model), model.node_points(), model.node_normals(), {}, turned);
  model_to_scan(Scan({surface.points, Triangles(0, 3), {}}, model), model.node_points(), model.node_normals(), {},
                bare);
  EXPECT_TRUE(turned.to_scan.distance_mm == straight.to_scan.distance_mm);
  EXPECT_TRUE(turned.covered.all() && bare.covered.all());
  EXPECT_NEAR(bare.to_scan.distance_mm.mean(), straight.to_scan.distance_mm.mean(), 0.2);
}

TEST(ScanToModel, SignIsRightOverTheSharpEdgesOfABox) {
  // A tent: two faces at 20 degrees; a point over one of them can lie below the plane of the other.
  Points points(4, 3);
  points << 0, -20, 0, 0, 20, 0, -2, 0, -11, 2, 0, -11;
  Triangles triangles(2, 3);
  triangles << 0, 1, 2, 1, 0, 3;
  Points queries(2, 3);
  queries << 0.5, 0, 3, 0, 0, -3;
  SignedDistances distances;
  scan_to_model({points, triangles}, queries, distances);
  EXPECT_NEAR(distances.distance_mm[0], std::hypot(0.5, 3), 1e-12);
  EXPECT_LT(distances.distance_mm[1], 0);
}

TEST(ScanToModel, DerivativeWithMovingVerticesIsOfSecondOrder) {
  const auto ball = testing::sphere(50, 2);
  Points scan = testing::random_points(400, -1, 1, 11);
  for (int i = 0; i < scan.rows(); ++i) scan.row(i) *= (44 + 0.03 * i) / scan.row(i).norm();
  const Points move = testing::random_points(static_cast<int>(ball.points.rows()), -1, 1, 12);
  const Points push = testing::random_points(400, -1, 1, 13);
  const Eigen::VectorXd factor = testing::random_points(400, 0.5, 1, 14).col(0);
  ModelSkin model = skin_of(ball);
  SignedDistances distances;
  const auto value = [&](double s) {
    model.move(ball.points + s * move);
    scan_to_model(model, scan + s * push, distances);
    return factor.dot(distances.distance_mm);
  };
  value(0);
  const Points unit = direction(scan, distances);
  double slope = 0;
  for (int i = 0; i < scan.rows(); ++i) {
    Eigen::RowVector3d closest_moves = Eigen::RowVector3d::Zero();
    for (int k = 0; k < 3; ++k)
      closest_moves += distances.closest.weight(i, k) * move.row(distances.closest.node(i, k));
    slope += factor[i] * unit.row(i).dot(push.row(i) - closest_moves);
  }
  ASSERT_GT(std::abs(slope), 1);
  EXPECT_GT(taylor_order(value, slope), 1.9);
  EXPECT_LT(taylor_order(value, 1.01 * slope), 1.1);
}

TEST(ScanToModel, DirectionOfATouchingPointIsTheNormal) {
  const auto flat = testing::sheet(0, 40, 4);
  Points scan(2, 3);
  scan << 13, 14, 0, 22, 17, 1e-10;
  SignedDistances distances;
  scan_to_model(skin_of(flat), scan, distances);
  const Points unit = direction(scan, distances);
  EXPECT_TRUE(unit.isApprox(Eigen::RowVector3d(0, 0, 1).replicate(2, 1), 1e-12));
}

TEST(ModelToScan, CoveredEndsAtBorderAndHole) {
  const ModelSkin model = skin_of(testing::sheet(0, 40, 4));
  const auto high = [](double, double) { return 2.0; };
  const auto covered = [&](const reconstruction::Surface& surface) {
    ModelToScan result;
    model_to_scan(Scan(surface, model), model.node_points(), model.node_normals(), {}, result);
    return result;
  };
  EXPECT_EQ(covered(testing::sheet(-10, 50, 12, high)).covered.count(), 25);
  EXPECT_EQ(covered(testing::sheet(5, 35, 6, high)).covered.count(), 9);
  const auto holed = testing::without(testing::sheet(-10, 50, 12, high), [](const Eigen::Vector3d& p) {
    return (p.head<2>().array() > 15).all() && (p.head<2>().array() < 25).all();
  });
  const ModelToScan result = covered(holed);
  EXPECT_EQ(result.covered.count(), 24);
  EXPECT_FALSE(result.covered[12]);  // the middle of the 5 × 5 points
}

TEST(ModelToScan, CoveredEndsAtTwentyMillimetresAndSixtyDegrees) {
  const ModelSkin model = skin_of(testing::sheet(0, 40, 4));
  const auto count = [&](double height, double angle_deg) {
    const Scan scan(testing::sheet(-10, 50, 12, [height](double, double) { return height; }), model);
    const double angle = angle_deg * pi / 180;
    const Points normals = Eigen::RowVector3d(std::sin(angle), 0, std::cos(angle)).replicate(25, 1);
    ModelToScan result;
    model_to_scan(scan, model.node_points(), normals, {}, result);
    return result.covered.count();
  };
  EXPECT_EQ(count(19.9, 0), 25);
  EXPECT_EQ(count(20.1, 0), 0);
  EXPECT_EQ(count(3, 59), 25);
  EXPECT_EQ(count(3, 61), 0);
  EXPECT_EQ(count(3, 180), 0);
}

TEST(ModelToScan, RefusesBadBounds) {
  const ModelSkin model = skin_of(testing::sheet(0, 40, 4));
  const Scan scan(testing::sheet(0, 40, 4), model);
  ModelToScan result;
  const Points points = model.node_points(), normals = model.node_normals();
  EXPECT_THROW(model_to_scan(scan, points, normals, {0, 60}, result), InputError);
  EXPECT_THROW(model_to_scan(scan, points, normals, {20, 91}, result), InputError);
  EXPECT_THROW(model_to_scan(scan, points, normals.topRows(3), {}, result), InputError);
}

/// A sphere of quadratic faces, their nodes on it.
meshing::TetMesh curved_sphere(double radius, int level) {
  const auto coarse = testing::sphere(radius, level);
  std::map<std::pair<int, int>, int> middles;
  std::vector<Eigen::RowVector3d> points;
  for (Eigen::Index p = 0; p < coarse.points.rows(); ++p) points.emplace_back(coarse.points.row(p));
  meshing::TetMesh mesh;
  mesh.faces.resize(coarse.triangles.rows(), 6);
  mesh.faces.leftCols(3) = coarse.triangles;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int a = 0; a < 3; ++a) {
      const int from = mesh.faces(f, a), to = mesh.faces(f, (a + 1) % 3);
      const auto [at, added] = middles.try_emplace(std::minmax(from, to), static_cast<int>(points.size()));
      const Eigen::RowVector3d between = points[static_cast<std::size_t>(from)] + points[static_cast<std::size_t>(to)];
      if (added) points.emplace_back(radius * between.normalized());
      mesh.faces(f, 3 + a) = at->second;
    }
  mesh.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t p = 0; p < points.size(); ++p) mesh.points.row(static_cast<Eigen::Index>(p)) = points[p];
  mesh.region = Eigen::VectorXi::Constant(mesh.faces.rows(), 2);
  return mesh;
}

TEST(ModelSkin, DistancesAreThoseToCurvedFaces) {
  const meshing::TetMesh mesh = curved_sphere(50, 2);  // edges of 15 mm: a flat face would be off by 0.56 mm
  const ModelSkin model(mesh, mesh.points);
  for (const double radius : {44.0, 53.0}) {
    const Points queries = radius * testing::random_points(300, -1, 1, 4).rowwise().normalized();
    SignedDistances distances;
    scan_to_model(model, queries, distances);
    EXPECT_LT((distances.distance_mm.array() - (radius - 50)).abs().maxCoeff(), 0.07);
    EXPECT_LT((distances.distance_mm.array() - (radius - 50)).abs().mean(), 0.05);
    const ClosestPoints& closest = distances.closest;
    ASSERT_EQ(closest.node.cols(), 6);
    EXPECT_LT((closest.weight.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
    for (Eigen::Index i = 0; i < queries.rows(); ++i) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 6; ++k) sum += closest.weight(i, k) * mesh.points.row(closest.node(i, k));
      ASSERT_LT((sum - closest.point.row(i)).norm(), 1e-9);
      const Eigen::RowVector3i quarter = model.triangles().row(closest.triangle[i]);
      for (const int node : quarter)
        ASSERT_LT((mesh.points.row(node) - closest.point.row(i)).norm(), 9.5) << "a corner of the quarter it lies in";
    }
  }
}

TEST(ModelSkin, CurvedFacesMoveDistancesAsTheirNodesDo) {
  const meshing::TetMesh mesh = curved_sphere(50, 2);
  const Points scan = 53 * testing::random_points(400, -1, 1, 11).rowwise().normalized();
  const Points move = testing::random_points(static_cast<int>(mesh.points.rows()), -1, 1, 12);
  const Eigen::VectorXd factor = testing::random_points(400, 0.5, 1, 14).col(0);
  ModelSkin model(mesh, mesh.points);
  SignedDistances distances;
  const auto value = [&](double s) {
    model.move(mesh.points + s * move);
    scan_to_model(model, scan, distances);
    return factor.dot(distances.distance_mm);
  };
  value(0);
  const Points unit = direction(scan, distances);
  double slope = 0;
  for (int i = 0; i < scan.rows(); ++i)
    for (int k = 0; k < 6; ++k)
      slope -= factor[i] * distances.closest.weight(i, k) * unit.row(i).dot(move.row(distances.closest.node(i, k)));
  ASSERT_GT(std::abs(slope), 1);
  EXPECT_GT(taylor_order(value, slope), 1.9);
  EXPECT_LT(taylor_order(value, 1.01 * slope), 1.1);
}

TEST(ModelSkin, QuadraticFaceIsFourFlatTrianglesForAreasAndPictures) {
  meshing::TetMesh mesh;
  mesh.points.resize(6, 3);
  mesh.points << 0, 0, 0, 8, 0, 0, 0, 8, 0, 4, 0, 1, 4, 4, 1, 0, 4, 1;
  mesh.faces.resize(1, 6);
  mesh.faces << 0, 1, 2, 3, 4, 5;
  mesh.region = Eigen::VectorXi::Constant(1, 2);
  const ModelSkin model(mesh, mesh.points);
  EXPECT_EQ(model.triangles().rows(), 4);
  EXPECT_EQ(model.nodes().size(), 6u);
  Points query(1, 3);
  query << 8. / 3, 8. / 3, 5;  // over the middle of the face, which lies at z = 4/3
  SignedDistances distances;
  scan_to_model(model, query, distances);
  EXPECT_NEAR(distances.distance_mm[0], 5 - 4. / 3, 0.1);
  EXPECT_EQ(distances.closest.triangle[0], 3) << "the quarter in the middle";
  EXPECT_GT(model.node_normals().col(2).minCoeff(), 0.8);
}

TEST(ModelSkin, RefusesAModelWithoutSkinAndOtherPositions) {
  meshing::TetMesh mesh;
  mesh.points = testing::random_points(3, 0, 9, 1);
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  mesh.region = Eigen::VectorXi::Constant(1, 1);
  EXPECT_THROW(ModelSkin(mesh, mesh.points), InputError);
  mesh.region[0] = 2;
  EXPECT_NO_THROW(ModelSkin(mesh, mesh.points));
  EXPECT_THROW(ModelSkin(mesh, mesh.points.topRows(2)), InputError);
}

}  // namespace supine::calibration
