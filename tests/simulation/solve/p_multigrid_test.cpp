// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/p_multigrid.h"

#include <gtest/gtest.h>

#include "simulation/model_fields.h"
#include "simulation/solve/krylov.h"
#include "simulation/solve/newton_direction.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

/// The quadratic dome, drawn out by a twentieth unless told: its tangents are what the cycle is made for.
struct DrawnDome {
  explicit DrawnDome(const Model& model, double stretch = 1.05)
      : scene(testing::dome_scene(2)),
        mechanics(scene.mesh, scene.anatomy, model),
        sums(mechanics.pattern()),
        x(scene.mesh.points) {
    mechanics.set_fields(
        values_of(make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, {0, -1, 0})));
    x.col(1) *= stretch;
    mechanics.evaluate(state(), Demand{.energy = true, .residual = true, .tangent = true, .convex = true}, sums);
  }
  State state() const { return {x, scene.mesh.points}; }
  Eigen::VectorXd random(int seed) const { return testing::random_matrix(static_cast<int>(x.size()), 1, seed); }

  const testing::TestScene& scene;
  Mechanics mechanics;
  Sums sums;
  Points x;
};

Model with_skin(double young_kpa) {
  Model model = testing::soft_model();
  model.skin.young_modulus_kpa.value = young_kpa;
  return model;
}

TEST(PMultigrid, ItsCycleIsSymmetricAndPositive) {
  const DrawnDome dome(with_skin(20));
  PMultigrid cycle(dome.sums.tangent, dome.scene.mesh.cells);
  ASSERT_TRUE(cycle.factorise(dome.sums.tangent));
  Eigen::VectorXd cu, cv;
  for (int seed = 1; seed < 5; ++seed) {
    const Eigen::VectorXd u = dome.random(seed), v = dome.random(seed + 10);
    cycle.solve(u, cu);
    cycle.solve(v, cv);
    EXPECT_GT(u.dot(cu), 0);
    const double single_precision = 1e-5;
    EXPECT_NEAR(u.dot(cv), v.dot(cu), single_precision * u.norm() * cv.norm());
  }
}

TEST(PMultigrid, IterationsAreFewHoweverStiffTheSkin) {
  for (const double skin_kpa : {0.5, 20.0, 1000.0})
    for (const double shift : {0.0, 2.5}) {
      const DrawnDome dome(with_skin(skin_kpa));
      PMultigrid cycle(dome.sums.tangent, dome.scene.mesh.cells);
      ASSERT_TRUE(cycle.factorise(dome.sums.tangent, shift));
      const auto matrix = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
        out = dome.sums.tangent * in + shift * in;
      };
      const auto inverse = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { cycle.solve(in, out); };
      const Eigen::VectorXd b = dome.random(3);
      Krylov krylov(b.size());
      Eigen::VectorXd x, product(b.size());
      const auto report = krylov.conjugate_gradients(matrix, inverse, b, {.tolerance = 1e-6, .max_iterations = 100}, x);
      EXPECT_TRUE(report.converged);
      EXPECT_LT(report.iterations, 30) << skin_kpa << " kPa, shift " << shift;
      matrix(x, product);
      EXPECT_LT((product - b).norm(), 1.1e-6 * b.norm());
    }
}

TEST(PMultigrid, RefusesAMatrixThatItSeesToBeIndefinite) {
  const DrawnDome dome(with_skin(20));
  PMultigrid cycle(dome.sums.tangent, dome.scene.mesh.cells);
  EXPECT_FALSE(cycle.factorise(dome.sums.tangent, -1e3));
  EXPECT_TRUE(cycle.factorise(dome.sums.tangent));
}

/// How far a step that was asked for with @p tolerance is off its linear system.
double defect(const Model& model, double tolerance, double stretch = 1.05) {
  DrawnDome dome(model, stretch);
  dome.mechanics.evaluate(dome.state(), Demand{.energy = true, .residual = true, .tangent = true}, dome.sums);
  NewtonDirection direction(dome.mechanics);
  Eigen::VectorXd step;
  EXPECT_TRUE(direction.deformed(dome.state(), tolerance, 10, dome.sums, step));
  EXPECT_TRUE(direction.exact());
  return (dome.sums.tangent * step + dome.sums.residual).norm() / dome.sums.residual.norm();
}

TEST(PMultigrid, StepsAreAsExactAsAskedFor) {
  EXPECT_LT(defect(with_skin(20), 1e-8), 1.1e-8);
  EXPECT_GT(defect(with_skin(20), 1e-2), 1e-6) << "a factor was made";
}

TEST(PMultigrid, NearlyIncompressibleCellsGetAFactor) {
  Model model = with_skin(20);
  model.breast.poisson_ratio.value = 0.4995;
  EXPECT_LT(defect(model, 1e-2, 1), 1e-7) << "a cycle stops at the tolerance";
}

}  // namespace
}  // namespace supine::simulation
