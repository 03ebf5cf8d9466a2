// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/skin_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "simulation/laws/skin_contact_law.h"
#include "simulation/mechanics.h"
#include "tests/simulation/two_blocks.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::random_matrix;
using testing::taylor_order;
using testing::TwoBlocks;

constexpr ContactSettings stiff{.kind = ContactKind::skin, .stiffness_kpa_per_mm = 2, .band_mm = 1};

TEST(SkinContactLaw, CurvesAreDerivativesOfEachOther) {
  const auto check = [](const auto& curve, double at, const char* name) {
    const Curve here = curve(at);
    ASSERT_NE(here.curvature, 0) << name;
    EXPECT_GT(taylor_order([&](double h) { return curve(at + h).value; }, here.slope, 1e-2), 1.9) << name;
    EXPECT_GT(taylor_order([&](double h) { return curve(at + h).slope; }, here.curvature, 1e-3), 1.8) << name;
  };
  check([](double g) { return contact_energy(g, 2, 1); }, 0.4, "energy");
  check(smooth_step, 0.3, "smooth_step");
  check(near_weight, 0.4, "near_weight");
  check(facing_weight, -0.45, "facing_weight");
  check(coverage, 0.4, "coverage");
}

TEST(SkinContactLaw, PressureSetsInAtTheBandAndGrowsByTheStiffness) {
  EXPECT_EQ(contact_energy(1.0, 2, 1).slope, 0);
  EXPECT_EQ(contact_energy(1.5, 2, 1).value, 0);
  EXPECT_DOUBLE_EQ(contact_energy(0.0, 2, 1).slope, -1);   // stiffness × band / 2
  EXPECT_DOUBLE_EQ(contact_energy(-3.0, 2, 1).slope, -7);  // and 2 kPa/mm from there
}

// Two blocks pressed into each other, all nodes moved a little, on both elements and with a tilt.
class SkinContactTest : public ::testing::TestWithParam<std::tuple<int, double>> {
 protected:
  SkinContactTest() : scene(make()), X(scene.mesh.points) {
    std::vector<int> rows;
    for (int f = 0; f < scene.mesh.faces.rows(); ++f)
      if (scene.mesh.region[f] == static_cast<int>(reconstruction::Region::skin)) rows.push_back(f);
    faces = scene.mesh.faces(rows, Eigen::all);
    term = std::make_unique<SkinContactTerm>(faces, X, stiff);
    const auto nodes = static_cast<int>(X.rows());
    x = X + 0.3 * random_matrix(nodes, 3, 1);
    for (Eigen::Index n = scene.first_upper; n < nodes; ++n) x.row(n) += Eigen::RowVector3d(1.5, -0.7, -4.2);
    v = random_matrix(nodes, 3, 2);
    sums = std::make_unique<Sums>(Pattern(scene.mesh.cells, nodes));
  }
  static testing::TwoBlocksScene make() {
    return testing::two_blocks_scene({.tilt_rad = std::get<1>(GetParam()), .order = std::get<0>(GetParam())});
  }
  const Sums& at(const Points& now, Demand demand) {
    sums->clear(demand);
    term->add({now, X}, demand, *sums);
    return *sums;
  }
  Eigen::VectorXd flat() const { return Eigen::Map<const Eigen::VectorXd>(v.data(), v.size()); }

  testing::TwoBlocksScene scene;
  Points X, x, v;
  Indices faces;
  std::unique_ptr<SkinContactTerm> term;
  std::unique_ptr<Sums> sums;
};

TEST_P(SkinContactTest, ForceIsTheDerivativeOfTheEnergyAndTheTangentOfTheForce) {
  const Sums here = at(x, {.energy = true, .residual = true, .tangent = true});
  ASSERT_GT(here.energy, 1);
  const double slope = here.residual.dot(flat());
  ASSERT_GT(std::abs(slope), 1e-2);
  EXPECT_GT(taylor_order([&](double h) { return at(x + h * v, {.energy = true}).energy; }, slope), 1.9);
  const Eigen::VectorXd curve = here.contact * flat();
  ASSERT_GT(curve.norm(), 1e-2);
  EXPECT_GT(taylor_order([&](double h) { return at(x + h * v, {.residual = true}).residual; }, curve), 1.9);
  EXPECT_LT((here.contact - SparseMatrix(here.contact.transpose())).norm(), 1e-12 * here.contact.norm());
}

TEST_P(SkinContactTest, ForcesAndMomentsAreInBalance) {
  const Sums& here = at(x, {.residual = true});
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = force, upper = force;
  for (Eigen::Index n = 0; n < x.rows(); ++n) {
    const Eigen::Vector3d f = here.residual.segment<3>(3 * n);
    force += f;
    moment += Eigen::Vector3d(x.row(n).transpose()).cross(f);
    if (n >= scene.first_upper) upper += f;
  }
  ASSERT_LT(upper.z(), -100) << "r is minus the force: the upper block is pushed up";
  EXPECT_LT(force.norm(), 1e-11 * upper.norm());
  EXPECT_LT(moment.norm(), 1e-10 * upper.norm());
}

TEST_P(SkinContactTest, TheConvexTangentHasNoNegativeCurvature) {
  const Sums here = at(x, {.residual = true, .tangent = true, .convex = true});
  ASSERT_GT(here.contact.norm(), 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen{Eigen::MatrixXd(here.contact)};
  EXPECT_GT(eigen.eigenvalues().minCoeff(), -1e-9 * eigen.eigenvalues().maxCoeff());
}

TEST_P(SkinContactTest, NothingActsInTheImagedShape) {
  const Sums& here = at(X, {.energy = true, .residual = true, .tangent = true});
  EXPECT_EQ(here.energy, 0);
  EXPECT_EQ(here.residual.norm(), 0);
  EXPECT_EQ(here.contact.nonZeros(), 0);
  EXPECT_EQ(term->left_out_imaged().pairs, 0);
}

TEST_P(SkinContactTest, PairsThatTouchInTheUndeformedShapeAreLeftOutAndTold) {
  const LeftOut left = term->left_out(x);
  EXPECT_GT(left.pairs, 0);
  EXPECT_LT(left.deepest_mm, 0);
  EXPECT_NEAR(left.place_mm.z(), 20, 4);
  Sums here(Pattern(scene.mesh.cells, X.rows()));
  term->add({x, x}, {.energy = true, .residual = true}, here);
  EXPECT_EQ(here.energy, 0);
  EXPECT_EQ(term->left_out(X).pairs, 0);
  const SkinContactTerm of_touching(faces, x, stiff);
  EXPECT_NEAR(of_touching.left_out_imaged().pairs, left.pairs, 0.05 * left.pairs);  // its reaches are those of x
}

TEST_P(SkinContactTest, AStepStopsWhereTheForcesStillLeadBack) {
  Points far = Points::Zero(X.rows(), 3);
  far.bottomRows(X.rows() - scene.first_upper).col(2).setConstant(-60);
  const Eigen::VectorXd step = Eigen::Map<const Eigen::VectorXd>(far.data(), far.size());
  const double share = term->safe_share(X, step);
  EXPECT_LT(share, 0.4);
  EXPECT_GT(60 * share, 4) << "beyond the gap";
  const ContactFigures there = term->figures({X + share * far, X});
  EXPECT_GT(there.overlap_mm, 0.5);
  EXPECT_GT(there.pressure_kpa, 1);
  EXPECT_EQ(term->safe_share(X, Eigen::VectorXd(-step)), 1) << "away from each other";
}

TEST_P(SkinContactTest, AShortStepStopsToo) {
  Points near = X, down = Points::Zero(X.rows(), 3);
  near.bottomRows(X.rows() - scene.first_upper).col(2).array() -= 3;  // of a gap of 4
  const auto share = [&](double mm) {
    down.bottomRows(X.rows() - scene.first_upper).col(2).setConstant(-mm);
    return term->safe_share(near, Eigen::Map<const Eigen::VectorXd>(down.data(), down.size()));
  };
  constexpr double far = 100;
  const double until = far * share(far);  // one mm and half the reach of the skin that is met first
  EXPECT_GT(until, 2);
  EXPECT_EQ(share(0.95 * until), 1);
  EXPECT_NEAR(1.2 * until * share(1.2 * until), until, 1e-9 * far);
}

INSTANTIATE_TEST_SUITE_P(All, SkinContactTest,
                         ::testing::Combine(::testing::Values(1, 2), ::testing::Values(0.0, 0.06)));

// A plate held flat on another: every sample feels the pressure of its gap, whatever the two meshes.
TEST(SkinContact, FlatPlatesFeelThePressureOfTheirGap) {
  for (const int order : {1, 2}) {
    const auto scene = testing::two_blocks_scene({.lower_mm = {60, 60, 20}, .lower_cubes = 6, .order = order});
    Model model = testing::soft_model();
    model.contact = stiff;
    const Mechanics mechanics(scene.mesh, scene.anatomy, model);
    Points x = scene.mesh.points;
    x.bottomRows(x.rows() - scene.first_upper).col(2).array() -= 3.5;  // gap 0.5 mm
    const ContactFigures figures = mechanics.contact()->figures({x, scene.mesh.points});
    EXPECT_NEAR(figures.pressure_kpa, 0.25, 1e-9);  // 2 (1 - 0.5)²/2
    EXPECT_EQ(figures.overlap_mm, 0);
    EXPECT_NEAR(figures.area_cm2, 2 * 16, 4);  // the lower skin is larger: a little beyond the upper one's edge too
    Sums sums(mechanics.pattern());
    mechanics.contact()->add({x, scene.mesh.points}, {.residual = true}, sums);
    double force = 0;
    for (Eigen::Index n = scene.first_upper; n < x.rows(); ++n) force -= sums.residual[3 * n + 2];
    EXPECT_NEAR(force, 0.25 * 1600, 0.1 * 0.25 * 1600) << "order " << order;
  }
}

}  // namespace
}  // namespace supine::simulation
