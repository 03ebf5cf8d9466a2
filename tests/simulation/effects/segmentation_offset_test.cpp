// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "simulation/mechanics.h"
#include "simulation/model_fields.h"
#include "tests/simulation/effects/effect_scene.h"

namespace supine::simulation {
namespace {

using meshing::TetMesh;
using testing::effect;

Points moved(const Points& points, const Eigen::VectorXd& by) {
  return points + Eigen::Map<const Points>(by.data(), points.rows(), 3);
}

class SegmentationOffsetTest : public ::testing::TestWithParam<int> {
 protected:
  SegmentationOffsetTest() : scene(testing::dome_scene(GetParam())), layout(make_layout(scene.mesh, scene.anatomy)) {}
  Eigen::VectorXd offset(double by_mm) const {
    Model model = testing::soft_model();
    model.effects = {effect("segmentation_offset", {{"offset_mm", by_mm}})};
    return values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "prone"}, {0, -1, 0})).imaged_offset;
  }
  const testing::TestScene& scene;
  Layout layout;
};

TEST_P(SegmentationOffsetTest, MovesTheSkinAlongItsNormalAndHoldsTheRest) {
  const TetMesh& mesh = scene.mesh;
  const Eigen::VectorXd by = offset(2);
  std::vector<char> held(mesh.points.rows(), 0);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    if (mesh.region[f] != static_cast<int>(reconstruction::Region::skin))
      for (const int n : mesh.faces.row(f)) held[n] = 1;
  const Eigen::Vector3d nipple = by.segment<3>(3 * scene.anatomy.nipple_point);
  EXPECT_NEAR(nipple.norm(), 2, 1e-12);
  EXPECT_GT(nipple.dot(scene.anatomy.outward), 1.8);
  double furthest = 0;
  for (Eigen::Index n = 0; n < mesh.points.rows(); ++n) {
    const double way = by.segment<3>(3 * n).norm();
    if (held[n]) {
      EXPECT_EQ(way, 0);
    }
    furthest = std::max(furthest, way);
  }
  EXPECT_LE(furthest, 2 + 1e-12) << "nodes inside move less than the skin does";
}

TEST_P(SegmentationOffsetTest, TurnsNothingInsideOut) {
  for (const double by_mm : {-3.0, 3.0}) {
    const Points there = moved(scene.mesh.points, offset(by_mm));
    EXPECT_GT(cell_det_f(scene.mesh.cells, there, scene.mesh.points).minCoeff(), 0.2) << by_mm;
  }
}

TEST_P(SegmentationOffsetTest, IsLinear) { EXPECT_LT((offset(2) + 2 * offset(-1)).norm(), 1e-12 * offset(2).norm()); }

INSTANTIATE_TEST_SUITE_P(Orders, SegmentationOffsetTest, ::testing::Values(1, 2));

TEST(SegmentationOffset, ChangesTheWeightWithTheImagedVolume) {
  const testing::TestScene& scene = testing::dome_scene();
  Model model = testing::soft_model();
  model.effects = {effect("segmentation_offset", {{"offset_mm", 1.5}})};
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  const auto fields = values_of(
      make_fields(model, {scene.mesh, scene.anatomy, mechanics.layout(), "supine"}, Eigen::Vector3d::UnitY()));
  mechanics.set_fields(fields);
  Sums sums(mechanics.pattern());
  const Points& X = scene.mesh.points;
  mechanics.evaluate({X, X}, Demand{.residual = true}, sums);
  const auto volume = [&scene](const Points& points) {
    double sum = 0;
    for (Eigen::Index c = 0; c < scene.mesh.cells.rows(); ++c) {
      const auto at = [&](int a) { return points.row(scene.mesh.cells(c, a)).transpose().eval(); };
      Eigen::Matrix3d edges;
      edges << at(1) - at(0), at(2) - at(0), at(3) - at(0);
      sum += edges.determinant() / 6;
    }
    return sum;
  };
  const double swollen = volume(moved(X, fields.imaged_offset));
  EXPECT_GT(swollen, 1.02 * volume(X));
  double weight = 0;
  for (Eigen::Index n = 0; n < X.rows(); ++n) weight -= sums.residual[3 * n + 1];
  EXPECT_NEAR(weight, 1e-6 * gravity_mm_s2 * swollen, 1e-9 * weight);
}

}  // namespace
}  // namespace supine::simulation
