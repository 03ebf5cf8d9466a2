// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include "common/error.h"
#include "simulation/model_fields.h"
#include "simulation/solve/equilibrium.h"
#include "simulation/terms/bulk.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

testing::TestScene block(int n, int order) {
  testing::TestScene scene = testing::box_scene(n, {40, 40, 40});
  if (order == 2) {
    scene.mesh = testing::quadratic(scene.mesh);
    scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
  }
  return scene;
}

/// How far the top of a block of 3 kPa on a clamped base moves along gravity that pulls sideways and down, mm.
double movement(int n, int order, Volumetric volumetric, double poisson, BulkLaw law = BulkLaw::neo_hookean) {
  const testing::TestScene scene = block(n, order);
  Model model = testing::soft_model(law);
  model.breast.young_modulus_kpa.value = 3;
  model.breast.poisson_ratio.value = poisson;
  model.breast.volumetric = volumetric;
  model.skin.young_modulus_kpa.value = 0;
  model.interface.kind = InterfaceKind::fixed;
  model.cut.stiffness_kpa_per_mm.value = 0;
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  const Eigen::Vector3d pull(0.8, 0, -0.6);
  mechanics.set_fields(
      values_of(make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, pull)));
  EquilibriumSolver solver(mechanics);
  Points x;
  solver.forward(scene.mesh.points, x, "block");
  double sum = 0;
  int count = 0;
  for (Eigen::Index p = 0; p < x.rows(); ++p)
    if (scene.mesh.points(p, 2) > 39.999) {
      sum += (x.row(p) - scene.mesh.points.row(p)).dot(pull);
      ++count;
    }
  return sum / count;
}

// A coarse mesh may be stiff, but not stiffer for ν = 0.499 than for 0.4.
TEST(Locking, MeanVolumeHoldsNearIncompressibilityAndPointwiseDoesNot) {
  const auto error = [](Volumetric volumetric, double poisson) {
    return 1 - movement(2, 2, volumetric, poisson) / movement(4, 2, Volumetric::mean, poisson);
  };
  const double moderate = error(Volumetric::pointwise, 0.4), held = error(Volumetric::mean, 0.499),
               locked = error(Volumetric::pointwise, 0.499);
  EXPECT_LT(held, 1.2 * moderate) << moderate;
  EXPECT_GT(locked, 1.8 * held) << held;
  EXPECT_LT(held, 0.11);
}

TEST(Locking, LawsAgreeWhereTheVolumeKeeps) {
  // The volume keeps on the mean of a cell; what is left is the part of λ that acts pointwise, where the laws differ.
  const double reference = movement(2, 2, Volumetric::mean, 0.499);
  EXPECT_NEAR(movement(2, 2, Volumetric::mean, 0.499, BulkLaw::neo_hookean_calculix), reference, 4e-3 * reference);
}

// Figures of docs/mechanics.md: why linear cells are warned about.
TEST(Locking, LinearCellsLockAndAreNamed) {
  EXPECT_LT(movement(4, 1, Volumetric::mean, 0.499), 0.6 * movement(4, 2, Volumetric::mean, 0.499));
  const Eigen::VectorXd moderate = Eigen::VectorXd::Constant(5, 0.45);
  Eigen::VectorXd high = moderate;
  high[3] = 0.495;
  EXPECT_TRUE(locking_warning(1, moderate, Volumetric::mean).empty());
  EXPECT_TRUE(locking_warning(2, high, Volumetric::mean).empty());
  EXPECT_NE(locking_warning(1, high, Volumetric::mean).find("--order 2"), std::string::npos);
  EXPECT_NE(locking_warning(2, high, Volumetric::pointwise).find("volumetric"), std::string::npos);
}

/// The tissue's term alone on a small block, away from rest.
class BulkAlone : public ::testing::Test {
 protected:
  template <class Element>
  Sums evaluate(const testing::TestScene& scene, const BulkSettings& settings, double poisson, double shape = 0,
                double stretch = 1.1) {
    const Pattern pattern(scene.mesh.cells, scene.mesh.points.rows());
    BulkTerm<Element> term(scene.mesh.cells, pattern, settings);
    const auto column = [&scene](double value) -> Eigen::VectorXd {
      return Eigen::VectorXd::Constant(scene.mesh.cells.rows(), value);
    };
    Fields<double> fields;
    fields.ln_young = fields.stiffening = fields.law_shape_2 = column(0);
    fields.law_shape_1 = column(shape);
    fields.poisson = column(poisson);
    term.set_fields(fields);
    const Points& X = scene.mesh.points;
    Points x = X + 0.3 * testing::random_matrix(static_cast<int>(X.rows()), 3, 1);
    x.col(0) *= stretch;
    Sums sums(pattern);
    const Demand demand{.energy = true, .residual = true, .tangent = true, .reference_tangent = true};
    sums.clear(demand);
    term.add({x, X}, demand, sums);
    return sums;
  }
};

TEST_F(BulkAlone, ModerateTissueIsTheSameBitForBitEitherWay) {
  const auto scene = block(1, 2);
  for (const BulkLaw law : {BulkLaw::neo_hookean, BulkLaw::corotational}) {
    const auto mean = evaluate<Tet10>(scene, {law, Volumetric::mean}, 0.33),
               pointwise = evaluate<Tet10>(scene, {law, Volumetric::pointwise}, 0.33);
    EXPECT_EQ(mean.energy, pointwise.energy);
    EXPECT_EQ(mean.residual, pointwise.residual);
    EXPECT_EQ((mean.tangent - pointwise.tangent).norm(), 0);
    EXPECT_EQ((mean.reference_tangent - pointwise.reference_tangent).norm(), 0);
  }
}

TEST_F(BulkAlone, LinearCellsHaveNothingToAverage) {
  const auto scene = block(2, 1);
  const auto mean = evaluate<Tet4>(scene, {BulkLaw::neo_hookean, Volumetric::mean}, 0.499),
             pointwise = evaluate<Tet4>(scene, {BulkLaw::neo_hookean, Volumetric::pointwise}, 0.499);
  EXPECT_EQ(mean.residual, pointwise.residual);
}

TEST_F(BulkAlone, GentBeyondItsLimitIsReportedLikeAnInvertedCell) {
  const auto scene = block(2, 1);
  EXPECT_TRUE(evaluate<Tet4>(scene, {BulkLaw::gent}, 0.45, 4).valid);
  const auto beyond = evaluate<Tet4>(scene, {BulkLaw::gent}, 0.45, 0.5, 2.2);
  EXPECT_FALSE(beyond.valid);
  EXPECT_LE(beyond.min_det_f, 0);
  EXPECT_GE(beyond.min_cell, 0);
}

TEST_F(BulkAlone, MooneyRivlinWithoutAConvexVolumePartIsRefused) {
  const auto scene = block(1, 1);
  EXPECT_NO_THROW(evaluate<Tet4>(scene, {BulkLaw::mooney_rivlin}, 0.3, 0.7));  // at most 0.75
  EXPECT_THROW(evaluate<Tet4>(scene, {BulkLaw::mooney_rivlin}, 0.3, 0.8), InputError);
  EXPECT_NO_THROW(evaluate<Tet4>(scene, {BulkLaw::mooney_rivlin}, 0.45, 1));
}

}  // namespace
}  // namespace supine::simulation
