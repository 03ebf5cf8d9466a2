// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/scan.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "common/error.h"
#include "tests/calibration/shapes.h"
#include "tests/support/shapes.h"

namespace supine::calibration {
namespace {

// What the scan's reader says; empty when it is content.
template <class Action>
std::string complaint(const Action& action) {
  try {
    action();
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

void expect_words(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words) EXPECT_NE(text.find(word), std::string::npos) << word << " in: " << text;
}

// A dome whose muscle lies at y = 0, breast toward -y, and a scan of its skin.
class DomeScan : public ::testing::Test {
 protected:
  meshing::TetMesh mesh = testing::dome_mesh();
  ModelSkin model{mesh, mesh.points};
  reconstruction::Surface skin{model.distance().points(), model.triangles(), {}};

  std::string placement(const reconstruction::Surface& surface) const {
    return complaint([&] { check_placement(Scan(surface, model, "s.ply"), model, mesh.muscle, "s.ply"); });
  }
};

}  // namespace

TEST_F(DomeScan, KeepsOnlyThePointsOfItsTriangles) {
  const Scan scan(skin, model);
  EXPECT_EQ(scan.points().rows(), static_cast<Eigen::Index>(model.nodes().size()));
}

TEST_F(DomeScan, ThreePointsAreRefused) {
  const auto text = complaint([&] { Scan({skin.points.topRows(3), Triangles(0, 3), {}}, model, "s.ply"); });
  expect_words(text, {"s.ply", "3 points", "100 points", "20 triangles"});
  EXPECT_NE(complaint([&] { Scan({skin.points.topRows(99), Triangles(0, 3), {}}, model); }), "");
  EXPECT_EQ(complaint([&] { Scan({skin.points.bottomRows(100), Triangles(0, 3), {}}, model); }), "");
}

TEST_F(DomeScan, NineteenTrianglesAreRefused) {
  const auto text = complaint([&] { Scan({skin.points, skin.triangles.topRows(19), {}}, model, "s.ply"); });
  expect_words(text, {"s.ply", "19 triangles", "20 triangles"});
  EXPECT_EQ(complaint([&] { Scan({skin.points, skin.triangles.topRows(20), {}}, model); }), "");
}

TEST_F(DomeScan, MetresAndMicrometresAreRefused) {
  auto metres = skin;
  metres.points *= 1e-3;
  expect_words(complaint([&] { Scan(metres, model, "s.ply"); }), {"s.ply", "metres", "1000"});
  auto micrometres = skin;
  micrometres.points *= 1e3;
  expect_words(complaint([&] { Scan(micrometres, model, "s.ply"); }), {"s.ply", "5000", "mm"});
}

TEST_F(DomeScan, NumbersThatAreNoneAreRefused) {
  skin.points(skin.triangles(0, 0), 0) = std::numeric_limits<double>::quiet_NaN();
  expect_words(complaint([&] { Scan(skin, model, "s.ply"); }), {"s.ply", "finite"});
}

TEST_F(DomeScan, TriangleThatNamesNoPointIsRefused) {
  skin.triangles(5, 1) = static_cast<int>(skin.points.rows());
  expect_words(complaint([&] { Scan(skin, model, "s.ply"); }), {"s.ply", "names point"});
}

TEST_F(DomeScan, InPlaceItIsAccepted) {
  EXPECT_EQ(placement(skin), "");
  skin.points.col(1).array() += 8;  // a prediction that is off by this is no misplaced scan
  EXPECT_EQ(placement(skin), "");
  EXPECT_EQ(placement({model.node_points(), Triangles(0, 3), {}}), "");
}

TEST_F(DomeScan, TwoHundredMillimetresAwayItIsRefused) {
  skin.points.col(2).array() += 200;
  expect_words(placement(skin), {"s.ply", "mm from the model's skin", "bound 30 mm", "LPS"});
}

TEST_F(DomeScan, WrittenAsRasItIsRefusedAndTheFlipIsNamed) {
  // Somewhere in the scanner, as patients are; the whole body moves, so the flip is not about its middle.
  for (const double shift : {0.0, 15.0, -60.0}) {
    auto body = mesh;
    body.points.col(0).array() += shift;
    body.muscle.points.col(0).array() += shift;
    const ModelSkin moved(body, body.points);
    reconstruction::Surface ras{moved.distance().points(), moved.triangles(), {}};
    ras.points.leftCols(2) *= -1;
    const auto text = complaint([&] { check_placement(Scan(ras, moved, "s.ply"), moved, body.muscle, "s.ply"); });
    expect_words(text, {"s.ply", "x and y negated it lies 0.0 mm", "RAS", "frame RAS"});
  }
}

TEST_F(DomeScan, BehindTheMuscleItIsRefused) {
  // Off the origin, so that the flip is no help.
  mesh.points.col(0).array() += 60;
  mesh.muscle.points.col(0).array() += 60;
  model = ModelSkin(mesh, mesh.points);
  reconstruction::Surface back = mesh.muscle;
  back.points.col(1).array() += 6;  // 18 mm from the rim's skin
  expect_words(placement(back), {"s.ply", "100 %", "behind it", "LPS"});
}

TEST_F(DomeScan, WrittenAsRasBehindTheMuscleAndOffThePredictionTheFlipIsStillNamed) {
  skin.points.col(1).array() += 7;
  skin.points.leftCols(2) *= -1;
  expect_words(placement(skin), {"RAS", "behind"});
}

}  // namespace supine::calibration
