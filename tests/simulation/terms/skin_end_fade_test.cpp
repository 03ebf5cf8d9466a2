// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_end_fade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "common/error.h"
#include "simulation/elements/elements.h"
#include "simulation/mechanics.h"
#include "simulation/terms/skin.h"
#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

constexpr double length_mm = 20;
const Eigen::Vector3d size_mm(60, 50, 40);  // skin on top, the four sides cut, muscle below

double expected(double distance_mm) {
  const double t = std::min(distance_mm / length_mm, 1.0);
  return t * t * (3 - 2 * t);
}

template <class Face>
void expect_shares(const meshing::TetMesh& mesh, const FaceGroup& group,
                   const std::function<double(const Eigen::RowVector3d&)>& distance_mm) {
  const Eigen::VectorXd share = fade_from_skin_end<Face>(mesh, group.faces, length_mm);
  ASSERT_EQ(share.size(), group.faces.size() * Face::points);
  int faded = 0;
  for (Eigen::Index f = 0; f < group.faces.size(); ++f)
    for (int p = 0; p < Face::points; ++p) {
      const Eigen::RowVector3d at =
          Face::table().value[p].transpose() * gather<Face::nodes>(mesh.points, mesh.faces, group.faces[f]);
      const double found = share[f * Face::points + p];
      EXPECT_NEAR(found, expected(distance_mm(at)), 1e-12);
      faded += found < 1;
    }
  EXPECT_GT(faded, 0);
}

TEST(SkinEndFade, GrowsFromNothingAtTheSkinsEndToAllOfIt) {
  for (const int order : {1, 2}) {
    testing::TestScene scene = testing::box_scene(5, size_mm);
    if (order == 2) {
      scene.mesh = testing::quadratic(scene.mesh);
      scene.anatomy.q = Table::Zero(scene.mesh.points.rows(), 2);
    }
    const Layout layout = make_layout(scene.mesh, scene.anatomy);
    const Eigen::RowVector3d low = scene.mesh.points.colwise().minCoeff(),
                             high = scene.mesh.points.colwise().maxCoeff();
    const auto to_rim = [&](const Eigen::RowVector3d& p) {
      return std::min((p - low).head<2>().minCoeff(), (high - p).head<2>().minCoeff());
    };
    const auto to_top = [&](const Eigen::RowVector3d& p) { return high.z() - p.z(); };
    if (order == 1) {
      expect_shares<Tri3Centroid>(scene.mesh, layout.skin, to_rim);
      expect_shares<Tri3>(scene.mesh, layout.cut, to_top);
    } else {
      expect_shares<Tri6>(scene.mesh, layout.skin, to_rim);
      expect_shares<Tri6>(scene.mesh, layout.cut, to_top);
    }
  }
}

TEST(SkinEndFade, NoLengthIsAllOfItEverywhere) {
  const testing::TestScene scene = testing::box_scene(2, size_mm);
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  EXPECT_EQ(fade_from_skin_end<Tri3>(scene.mesh, layout.cut.faces, 0).size(), 0);
}

TEST(SkinEndFade, RefusesSkinThatEndsNowhere) {
  testing::TestScene scene = testing::box_scene(2, size_mm);
  scene.mesh.region.setConstant(static_cast<int>(reconstruction::Region::skin));
  const Eigen::VectorXi all =
      Eigen::VectorXi::LinSpaced(scene.mesh.faces.rows(), 0, static_cast<int>(scene.mesh.faces.rows()) - 1);
  try {
    fade_from_skin_end<Tri3>(scene.mesh, all, length_mm);
    FAIL() << "no message";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("skin.fade_mm is 20"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace supine::simulation
