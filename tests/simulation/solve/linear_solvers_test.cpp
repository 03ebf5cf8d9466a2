// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>
#include <omp.h>

#include <limits>

#include "simulation/model_fields.h"
#include "simulation/solve/krylov.h"
#include "simulation/solve/linear_solver.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

/// Tangents of the dome, loaded and deformed: the matrices the solvers are made for.
class LinearSolversTest : public ::testing::Test {
 protected:
  LinearSolversTest() : scene(testing::dome_scene()), model(testing::soft_model()) {
    mechanics = std::make_unique<Mechanics>(scene.mesh, scene.anatomy, model);
    mechanics->set_fields(
        values_of(make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics->layout(), "prone"}, {0, -1, 0})));
    sums = std::make_unique<Sums>(mechanics->pattern());
    Points x = scene.mesh.points;
    x.col(1) *= 1.05;
    mechanics->evaluate({x, scene.mesh.points},
                        Demand{.residual = true, .tangent = true, .reference_tangent = true, .convex = true}, *sums);
    b = testing::random_matrix(static_cast<int>(mechanics->pattern().dofs()), 1, 5);
  }
  testing::TestScene scene;
  Model model;
  std::unique_ptr<Mechanics> mechanics;
  std::unique_ptr<Sums> sums;
  Eigen::VectorXd b;
};

TEST_F(LinearSolversTest, CholeskySolvesAndShifts) {
  CholeskySolver solver(sums->tangent);
  for (const double shift : {0.0, 2.5}) {
    ASSERT_TRUE(solver.factorise(sums->tangent, shift));
    const Eigen::VectorXd x = solver.solve(b);
    EXPECT_LT((sums->tangent * x + shift * x - b).norm(), 1e-10 * b.norm());
  }
  EXPECT_GT(solver.solves_per_factor(), 0.1);
}

TEST_F(LinearSolversTest, CholeskyRefusesAnIndefiniteMatrix) {
  CholeskySolver solver(sums->tangent);
  EXPECT_FALSE(solver.factorise(sums->tangent, -1e3));
  EXPECT_TRUE(solver.factorise(sums->tangent));
}

TEST_F(LinearSolversTest, LuSolvesBothWays) {
  LuSolver solver(sums->reference_tangent);
  ASSERT_TRUE(solver.factorise(sums->reference_tangent));
  EXPECT_LT((sums->reference_tangent * solver.solve(b) - b).norm(), 1e-9 * b.norm());
  EXPECT_LT((sums->reference_tangent.transpose() * solver.solve_transposed(b) - b).norm(), 1e-9 * b.norm());
}

TEST_F(LinearSolversTest, ManyAtATimeAreThoseOneByOne) {
  const Eigen::MatrixXd many = testing::random_matrix(static_cast<int>(b.size()), 37, 6);
  CholeskySolver cholesky(sums->tangent);
  ASSERT_TRUE(cholesky.factorise(sums->tangent));
  LuSolver lu(sums->reference_tangent);
  ASSERT_TRUE(lu.factorise(sums->reference_tangent));
  const Eigen::MatrixXd by_cholesky = cholesky.solve(many), by_lu = lu.solve(many);
  for (const Eigen::Index k : {0, 15, 16, 36}) {
    const Eigen::VectorXd one = cholesky.solve(many.col(k)), other = lu.solve(many.col(k));
    EXPECT_LT((by_cholesky.col(k) - one).norm(), 1e-12 * one.norm());
    EXPECT_LT((by_lu.col(k) - other).norm(), 1e-12 * other.norm());
  }
}

TEST_F(LinearSolversTest, ManyAtATimeAreTheSameForAnyNumberOfThreads) {
  const Eigen::MatrixXd many = testing::random_matrix(static_cast<int>(b.size()), 37, 6);
  CholeskySolver cholesky(sums->tangent);
  ASSERT_TRUE(cholesky.factorise(sums->tangent));
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const Eigen::MatrixXd alone = cholesky.solve(many);
  omp_set_num_threads(3);
  const Eigen::MatrixXd together = cholesky.solve(many);
  omp_set_num_threads(before);
  EXPECT_EQ(alone, together);
}

TEST_F(LinearSolversTest, KrylovReachesTheAskedTolerance) {
  CholeskySolver factor(sums->tangent);
  // The factor of a stiffer matrix: a preconditioner that is not the inverse.
  ASSERT_TRUE(factor.factorise(sums->tangent, 5));
  const auto inverse = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor.solve(in, out); };
  const auto by = [](const SparseMatrix& matrix) {
    return [&matrix](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out.noalias() = matrix * in; };
  };
  Krylov krylov(b.size());
  Eigen::VectorXd x;
  for (const double tolerance : {1e-2, 1e-9}) {
    const KrylovOptions options{.tolerance = tolerance, .max_iterations = 500};
    const auto cg = krylov.conjugate_gradients(by(sums->tangent), inverse, b, options, x);
    EXPECT_TRUE(cg.converged);
    EXPECT_LE((sums->tangent * x - b).norm(), 1.01 * tolerance * b.norm());
    const auto gmres = krylov.gmres(by(sums->reference_tangent), inverse, b, options, x);
    EXPECT_TRUE(gmres.converged);
    EXPECT_LE((sums->reference_tangent * x - b).norm(), 1.01 * tolerance * b.norm());
  }
}

TEST_F(LinearSolversTest, ConjugateGradientsReportNegativeCurvature) {
  CholeskySolver factor(sums->tangent);
  ASSERT_TRUE(factor.factorise(sums->tangent));
  const auto inverse = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor.solve(in, out); };
  const auto turned = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out = -(sums->tangent * in); };
  Krylov krylov(b.size());
  Eigen::VectorXd x;
  const auto report = krylov.conjugate_gradients(turned, inverse, b, {.tolerance = 1e-6, .max_iterations = 100}, x);
  EXPECT_TRUE(report.negative_curvature);
  EXPECT_FALSE(report.converged);
}

TEST_F(LinearSolversTest, ConjugateGradientsStopOnADescentWhereTheMatrixIsNotDefinite) {
  CholeskySolver factor(sums->tangent);
  ASSERT_TRUE(factor.factorise(sums->tangent, 5));
  const auto inverse = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor.solve(in, out); };
  // One direction of negative curvature, which b has little of.
  const Eigen::VectorXd v = testing::random_matrix(static_cast<int>(b.size()), 1, 6).normalized();
  const double curvature = v.dot(sums->tangent * v);
  const auto bent = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    out = sums->tangent * in - 1.5 * curvature * v.dot(in) * v;
  };
  Krylov krylov(b.size());
  Eigen::VectorXd x, way, product(b.size());
  const auto report = krylov.conjugate_gradients(bent, inverse, b, {.tolerance = 1e-9, .max_iterations = 500}, x, &way);
  ASSERT_TRUE(report.negative_curvature);
  ASSERT_GT(report.iterations, 0);
  const auto quadratic = [&](const Eigen::VectorXd& at) {
    bent(at, product);
    return 0.5 * at.dot(product) - b.dot(at);
  };
  EXPECT_GT(b.dot(x), 0);
  EXPECT_LT(quadratic(x), 0);
  EXPECT_GT(b.dot(way), 0);
  EXPECT_LT(quadratic(x + way), quadratic(x));
  EXPECT_LT(quadratic(x + 100 * way), quadratic(x + way)) << "it goes on falling";
}

TEST_F(LinearSolversTest, ConjugateGradientsGiveUpWhereTheyAreTooSlow) {
  CholeskySolver factor(sums->tangent);
  ASSERT_TRUE(factor.factorise(sums->tangent, 5));
  const auto inverse = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { factor.solve(in, out); };
  const auto nothing = [](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out = in; };
  const auto matrix = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out = sums->tangent * in; };
  Krylov krylov(b.size());
  Eigen::VectorXd x;
  const auto iterations = [&](const LinearMap& preconditioner, double tolerance, double worth) {
    const KrylovOptions options{.tolerance = tolerance, .max_iterations = 60, .worthwhile_reduction = worth};
    return krylov.conjugate_gradients(matrix, preconditioner, b, options, x).iterations;
  };
  const double patient = std::numeric_limits<double>::infinity();
  ASSERT_EQ(iterations(nothing, 1e-12, patient), 60);
  EXPECT_LT(iterations(nothing, 1e-12, 1e-6), 20);
  // What is fast enough is left to end.
  const int enough = iterations(inverse, 1e-6, patient);
  ASSERT_GT(enough, 6);
  ASSERT_LT(enough, 60);
  EXPECT_EQ(iterations(inverse, 1e-6, 0.1), enough);
}

}  // namespace
}  // namespace supine::simulation
