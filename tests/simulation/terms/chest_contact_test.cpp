// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/chest_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "common/error.h"
#include "simulation/mechanics.h"
#include "simulation/model_fields.h"
#include "simulation/solve/chain.h"
#include "simulation/solve/overlap.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::random_matrix;
using testing::taylor_order;

// A dome pushed off its place until its skin lies in the chest beside it; on both elements.
class ChestContactTest : public ::testing::TestWithParam<int> {
 protected:
  ChestContactTest() : scene(testing::dome_scene(GetParam())), X(scene.mesh.points) {
    model.contact.kind = ContactKind::chest;
    mechanics = std::make_unique<Mechanics>(scene.mesh, scene.anatomy, model);
    term = mechanics->chest_contact();
    x = X + 0.3 * random_matrix(static_cast<int>(X.rows()), 3, 1);
    x.rowwise() += (40 * scene.anatomy.lateral - 18 * scene.anatomy.outward).transpose();
    v = random_matrix(static_cast<int>(X.rows()), 3, 2);
    sums = std::make_unique<Sums>(mechanics->pattern());
  }
  const Sums& at(const Points& now, const Points& rest, Demand demand) {
    sums->clear(demand);
    term->add({now, rest}, demand, *sums);
    return *sums;
  }
  Eigen::VectorXd flat() const { return Eigen::Map<const Eigen::VectorXd>(v.data(), v.size()); }

  const testing::TestScene& scene;
  Model model = testing::soft_model();
  std::unique_ptr<Mechanics> mechanics;
  const ChestContact* term = nullptr;
  Points X, x, v;
  std::unique_ptr<Sums> sums;
};

TEST_P(ChestContactTest, ForceIsTheDerivativeOfTheEnergyAndTheTangentOfTheForce) {
  const Sums here = at(x, X, {.energy = true, .residual = true, .tangent = true});
  ASSERT_GT(here.energy, 1);
  const double slope = here.residual.dot(flat());
  ASSERT_GT(std::abs(slope), 1e-2);
  EXPECT_GT(taylor_order([&](double h) { return at(x + h * v, X, {.energy = true}).energy; }, slope), 1.9);
  const Eigen::VectorXd curve = here.tangent.selfadjointView<Eigen::Lower>() * flat();
  ASSERT_GT(curve.norm(), 1e-2);
  EXPECT_GT(taylor_order([&](double h) { return at(x + h * v, X, {.residual = true}).residual; }, curve), 1.9);
}

TEST_P(ChestContactTest, TheConvexTangentHasNoNegativeCurvature) {
  const Sums here = at(x, X, {.tangent = true, .convex = true});
  ASSERT_GT(here.tangent.norm(), 1);
  std::vector<int> touched;  // the other rows are zero
  for (int k = 0; k < here.tangent.outerSize(); ++k)
    if (here.tangent.col(k).norm() > 0) touched.push_back(k);
  const Eigen::MatrixXd whole(here.tangent);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(whole(touched, touched), Eigen::EigenvaluesOnly);
  EXPECT_GT(eigen.eigenvalues().minCoeff(), -1e-9 * eigen.eigenvalues().maxCoeff());
}

TEST_P(ChestContactTest, NothingActsInTheImagedShapeNorOnTheUndeformedOne) {
  const Sums& here = at(X, X, {.energy = true, .residual = true, .reference_tangent = true});
  EXPECT_EQ(here.energy, 0);
  EXPECT_EQ(here.residual.norm(), 0);
  EXPECT_EQ(here.reference_tangent.norm(), 0) << "nor does it depend on the undeformed shape";
  EXPECT_EQ(term->left_out_imaged().pairs, 0);
}

TEST_P(ChestContactTest, WhatLiesInTheChestFreeOfLoadIsLeftOutAndTold) {
  const LeftOut left = term->left_out(x);
  EXPECT_GT(left.pairs, 0);
  EXPECT_LT(left.deepest_mm, -3);
  EXPECT_EQ(at(x, x, {.energy = true}).energy, 0);
  EXPECT_GT(at(x, X, {.energy = true}).energy, 1) << "and acts again where another shape is free of load";
}

TEST_P(ChestContactTest, FiguresAreThoseOfTheForces) {
  const ContactFigures figures = term->figures({.x = x, .X = X});
  const Overlap overlap = find_in_chest(*meshing::chest_beside(scene.mesh, scene.anatomy),
                                        scene.mesh.faces(mechanics->layout().skin.faces, Eigen::all), x);
  EXPECT_GT(overlap.deepest_mm, 5);
  EXPECT_NEAR(figures.overlap_mm, overlap.deepest_mm, 0.25 * overlap.deepest_mm) << "points of faces, and nodes";
  const ContactSettings& contact = model.contact;
  EXPECT_GT(figures.pressure_kpa, 0.8 * contact.stiffness_kpa_per_mm * (figures.overlap_mm - contact.band_mm));
  EXPECT_GT(figures.area_cm2, 10);
  // The pressures on all faces together are the force on the nodes, as far as they point the same way.
  const Sums& here = at(x, X, {.residual = true});
  const double force = Eigen::Map<const Points>(here.residual.data(), x.rows(), 3).colwise().sum().norm();
  const Indices skin = scene.mesh.faces(mechanics->layout().skin.faces, Eigen::all);
  double pressed = 0;
  for (Eigen::Index f = 0; f < skin.rows(); ++f) {
    const Eigen::RowVector3d a = x.row(skin(f, 0)), b = x.row(skin(f, 1)), c = x.row(skin(f, 2));
    pressed += figures.face_kpa[f] * 0.5 * (b - a).cross(c - a).norm();
  }
  EXPECT_LT(force, 1.15 * pressed);
  EXPECT_GT(force, 0.7 * pressed);
  EXPECT_NE(in_chest_warning("supine", overlap, contact).find("contact notwithstanding"), std::string::npos);
  EXPECT_NE(in_chest_warning("supine", overlap, {}).find("kind = \"chest\""), std::string::npos);
  EXPECT_EQ(in_chest_warning("supine", {.samples = 1, .deepest_mm = 2.9}, contact), "");
}

INSTANTIATE_TEST_SUITE_P(Orders, ChestContactTest, ::testing::Values(1, 2));

// On springs too weak to hold it a dome slides aside and sinks: into the chest beside it without contact, hardly with.
TEST(ChestContact, CarriesABreastThatLiesOnTheChest) {
  const testing::TestScene& scene = testing::dome_scene();
  Model model = testing::soft_model();
  model.breast.young_modulus_kpa.value = 4;
  model.interface.normal_kpa_per_mm.value = 0.02;
  model.interface.tangential_kpa_per_mm.value = 0.006;
  model.cut.stiffness_kpa_per_mm.value = 1e-3;
  const Eigen::Vector3d side = (scene.anatomy.lateral - 0.5 * scene.anatomy.outward).normalized();
  const std::vector<PoseLoad> poses = {{free_of_load, side}, {"lateral", side}};
  testing::TestScene imaged = scene;
  imaged.anatomy.imaged_pose = free_of_load;
  const auto solved = [&](ContactKind kind) {
    model.contact.kind = kind;
    return solve_chain(imaged.mesh, imaged.anatomy, model, poses);
  };
  const ChainSolution free = solved(ContactKind::off), held = solved(ContactKind::chest);
  const meshing::ChestBeside chest = *meshing::chest_beside(scene.mesh, scene.anatomy);
  const Indices skin = scene.mesh.faces(make_layout(scene.mesh, scene.anatomy).skin.faces, Eigen::all);
  const double deep = find_in_chest(chest, skin, free.poses[0].x).deepest_mm;
  ASSERT_GT(deep, 3.5);
  EXPECT_LT(find_in_chest(chest, skin, held.poses[0].x).deepest_mm, 0.3 * deep);
  ASSERT_TRUE(held.poses[0].chest_contact);
  EXPECT_GT(held.poses[0].chest_contact->area_cm2, 2);
  const auto told = [](const ChainSolution& solution) {
    for (const std::string& warning : solution.warnings)
      if (warning.find("inside the chest") != std::string::npos) return true;
    return false;
  };
  EXPECT_TRUE(told(free));
  EXPECT_FALSE(told(held));
}

TEST(ChestContact, IsRefusedWhereThereIsNoChest) {
  const testing::TestScene bar = testing::bar_scene(40, 10, 4, 2);
  Model model = testing::soft_model();
  model.contact.kind = ContactKind::chest;
  EXPECT_THROW(Mechanics(bar.mesh, bar.anatomy, model), InputError);
}

}  // namespace
}  // namespace supine::simulation
