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

Model block_model(Volumetric volumetric, double poisson, BulkLaw law) {
  Model model = testing::soft_model(law);
  model.breast.young_modulus_kpa.value = 3;
  model.breast.poisson_ratio.value = poisson;
  model.breast.volumetric = volumetric;
  model.skin.young_modulus_kpa.value = 0;
  model.interface.kind = InterfaceKind::fixed;
  model.cut.stiffness_kpa_per_mm.value = 0;
  return model;
}

/// A block of 3 kPa on a clamped base under gravity that pulls sideways and down.
struct PulledBlock {
  testing::TestScene scene;
  Model model;
  Mechanics mechanics;
  const Eigen::Vector3d pull{0.8, 0, -0.6};

  PulledBlock(int n, int order, Volumetric volumetric, double poisson, BulkLaw law = BulkLaw::neo_hookean)
      : scene(block(n, order)),
        model(block_model(volumetric, poisson, law)),
        mechanics(scene.mesh, scene.anatomy, model) {
    mechanics.set_fields(
        values_of(make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, pull)));
  }
  SolveReport solve(Points& x) const { return EquilibriumSolver(mechanics).forward(scene.mesh.points, x, "block"); }
};

/// How far its top moves along gravity, mm.
double movement(int n, int order, Volumetric volumetric, double poisson, BulkLaw law = BulkLaw::neo_hookean) {
  const PulledBlock pulled(n, order, volumetric, poisson, law);
  const Points& rest = pulled.scene.mesh.points;
  Points x;
  pulled.solve(x);
  double sum = 0;
  int count = 0;
  for (Eigen::Index p = 0; p < x.rows(); ++p)
    if (rest(p, 2) > 39.999) {
      sum += (x.row(p) - rest.row(p)).dot(pulled.pull);
      ++count;
    }
  return sum / count;
}

// Figures of docs/mechanics.md: 16 steps where the pressure inside the tangent is that of the shape.
TEST(Locking, NewtonsStepsDoNotGrowTowardIncompressibility) {
  Points x;
  const int moderate = PulledBlock(4, 2, Volumetric::mean, 0.45).solve(x).newton_iterations;
  EXPECT_LE(PulledBlock(4, 2, Volumetric::mean, 0.4995).solve(x).newton_iterations, 2 * moderate) << moderate;
}

/// The entries of nodes above the clamped base; 0 on it.
Eigen::VectorXd free_part(const Points& X, Eigen::VectorXd entries) {
  for (Eigen::Index n = 0; n < X.rows(); ++n)
    if (X(n, 2) < 1e-9) entries.segment<3>(3 * n).setZero();
  return entries;
}

// With q in the place of the shape's own volume strain: ∂r/∂x s is how the mixed form's residual moves with x and q.
TEST(Locking, TangentAtAPressureOfItsOwnIsThatOfTheMixedForm) {
  for (const BulkLaw law : {BulkLaw::neo_hookean, BulkLaw::neo_hookean_calculix, BulkLaw::corotational}) {
    const PulledBlock pulled(2, 2, Volumetric::mean, 0.499, law);
    const Points& X = pulled.scene.mesh.points;
    const int nodes = static_cast<int>(X.rows()), cells = static_cast<int>(pulled.scene.mesh.cells.rows());
    const Points x = X + 0.2 * testing::random_matrix(nodes, 3, 1);
    const Eigen::VectorXd q = 0.02 * testing::random_matrix(cells, 1, 2),
                          step = free_part(X, testing::random_matrix(3 * nodes, 1, 3));
    Sums sums(pulled.mechanics.pattern());
    Eigen::VectorXd strain, change;
    const VolumeStrainTerm& volume = pulled.mechanics.volume();
    volume.volume_strain({x, X}, step, strain, change);
    const auto mixed = [&](double h) -> Eigen::VectorXd {
      Points there = x;
      Eigen::Map<Eigen::VectorXd>(there.data(), there.size()) += h * step;
      const Eigen::VectorXd strain_there = q + h * change;
      const State state{.x = there, .X = X, .volume_strain = &strain_there};
      pulled.mechanics.evaluate(state, Demand{.residual = true}, sums);
      Eigen::VectorXd residual = sums.residual;
      volume.take_off_pressure_defect(state, residual);
      return residual;
    };
    pulled.mechanics.evaluate({.x = x, .X = X, .volume_strain = &q}, Demand{.residual = true, .tangent = true}, sums);
    const Eigen::VectorXd slope = sums.tangent * step;
    EXPECT_GT(testing::taylor_order([&](double h) { return free_part(X, mixed(h)); }, slope), 1.9) << name_of(law);
  }
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
    BulkTerm<Element> term(std::make_shared<const Elements>(scene.mesh.cells, pattern), settings);
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
