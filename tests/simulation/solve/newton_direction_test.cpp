// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/newton_direction.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "simulation/model_fields.h"
#include "simulation/solve/linear_solver.h"
#include "simulation/solve/pushed_forward.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

/// The mechanics of a scene under gravity along @p gravity.
struct Loaded {
  Loaded(const testing::TestScene& scene, const Eigen::Vector3d& gravity, const Model& model = testing::soft_model())
      : mechanics(scene.mesh, scene.anatomy, model), sums(mechanics.pattern()) {
    mechanics.set_fields(
        values_of(make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "supine"}, gravity)));
  }
  void evaluate(const State& state, bool convex = false) {
    mechanics.evaluate(state, Demand{.energy = true, .residual = true, .tangent = true, .convex = convex}, sums);
  }
  Mechanics mechanics;
  Sums sums;
};

TEST(NewtonDirection, MovingAPointWithItsPlaceLeavesTheBalance) {
  for (const int order : {1, 2}) {
    testing::TestScene scene = testing::box_scene(4, {30, 30, 30});
    if (order == 2) {
      scene.mesh = testing::quadratic(scene.mesh);
      EXPECT_THROW(Loaded(scene, Eigen::Vector3d::Zero()), InputError) << "the anatomy is that of the linear mesh";
      scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
    }
    Loaded body(scene, Eigen::Vector3d::Zero());
    const Points& X = scene.mesh.points;
    Eigen::Matrix3d stretched;
    stretched << 1.2, 0.3, 0, -0.1, 0.8, 0.2, 0, 0.1, 1.1;
    const Points x = X * stretched.transpose();
    body.mechanics.evaluate({x, X}, Demand{.residual = true, .tangent = true, .reference_tangent = true}, body.sums);
    // Inside, where the stretch is the same all around.
    Eigen::VectorXd v = testing::random_matrix(static_cast<int>(X.size()), 1, 3), pushed = v;
    const auto f = nodal_deformation(scene.mesh.cells, x, X);
    for (Eigen::Index n = 0; n < X.rows(); ++n) {
      if (X.row(n).minCoeff() < 1 || X.row(n).maxCoeff() > 29) v.segment<3>(3 * n).setZero();
      pushed.segment<3>(3 * n) = f[static_cast<std::size_t>(n)] * v.segment<3>(3 * n);
    }
    ASSERT_GT(v.norm(), 0);
    const Eigen::VectorXd by_place = body.sums.tangent * pushed;
    EXPECT_LT((body.sums.reference_tangent * v + by_place).norm(), 1e-10 * by_place.norm()) << "order " << order;
  }
}

TEST(NewtonDirection, TheUndeformedStepSolvesItsSystem) {
  const testing::TestScene& scene = testing::dome_scene(2);
  Loaded body(scene, {0, -1, 0});
  Points x = scene.mesh.points;
  x.col(1) *= 1.05;
  const State state{x, scene.mesh.points};
  body.mechanics.evaluate(state, Demand{.residual = true, .reference_tangent = true}, body.sums);
  NewtonDirection direction(body.mechanics);
  Eigen::VectorXd step;
  ASSERT_TRUE(direction.undeformed(state, 1e-8, body.sums, step));
  const Eigen::VectorXd left = body.sums.reference_tangent * step + body.sums.residual;
  EXPECT_LT(left.norm(), 1.01e-8 * body.sums.residual.norm());
  EXPECT_EQ(direction.factorisations(), 1);
}

TEST(NewtonDirection, OneIterationUndoesWhatWasMovedInsideAnEvenStretch) {
  const testing::TestScene scene = testing::box_scene(4, {30, 30, 30});
  Loaded body(scene, Eigen::Vector3d::Zero());
  const Points& X = scene.mesh.points;
  Eigen::Matrix3d stretched;
  stretched << 1.1, 0.1, 0, 0, 1.05, 0.05, 0, 0, 1.08;
  const Points x = X * stretched.transpose();
  const State state{x, X};
  body.mechanics.evaluate(state, Demand{.residual = true, .reference_tangent = true}, body.sums);
  NewtonDirection direction(body.mechanics);
  Eigen::VectorXd step, v = testing::random_matrix(static_cast<int>(X.size()), 1, 3);
  ASSERT_TRUE(direction.undeformed(state, 0.1, body.sums, step));
  ASSERT_EQ(direction.factorisations(), 1);
  for (Eigen::Index n = 0; n < X.rows(); ++n)
    if (X.row(n).minCoeff() < 1 || X.row(n).maxCoeff() > 29) v.segment<3>(3 * n).setZero();
  body.sums.residual = body.sums.reference_tangent * v;
  const double one_iteration = 0.99;
  ASSERT_TRUE(direction.undeformed(state, one_iteration, body.sums, step));
  EXPECT_LT((step + v).norm(), 1e-8 * v.norm());
}

Model stiff_skin() {
  Model model = testing::soft_model();
  model.skin.young_modulus_kpa.value = 1000;
  return model;
}

/// A dome drawn out until the squeezed skin takes the tangent its definiteness.
class SqueezedDome : public ::testing::Test {
 protected:
  SqueezedDome() : scene(testing::dome_scene()), body(scene, {0, -1, 0}, stiff_skin()), x(scene.mesh.points) {
    const double squeeze = 0.93;
    x.col(0) *= squeeze;
    x.col(1) /= squeeze;
    x.col(2) *= squeeze;
    body.evaluate({x, scene.mesh.points});
  }
  double slope(const Eigen::VectorXd& along) const { return body.sums.residual.dot(along); }

  const testing::TestScene& scene;
  Loaded body;
  Points x;
  Eigen::VectorXd step;
};

TEST_F(SqueezedDome, StepsDownhillFarAndNear) {
  CholeskySolver factor(body.sums.tangent);
  ASSERT_FALSE(factor.factorise(body.sums.tangent));
  const State state{x, scene.mesh.points};
  for (const double moved_mm : {10.0, 0.5}) {
    NewtonDirection direction(body.mechanics);
    body.evaluate(state);
    ASSERT_TRUE(direction.deformed(state, 1e-3, moved_mm, body.sums, step));
    EXPECT_FALSE(direction.exact());
    EXPECT_LT(slope(step), 0);
    EXPECT_EQ(direction.factorisations(), 2) << "the exact tangent and the changed one";
  }
}

TEST_F(SqueezedDome, FollowsNegativeCurvatureDeeperThanTheChangedTangentGoes) {
  const State state{x, scene.mesh.points};
  body.evaluate(state, true);
  CholeskySolver factor(body.sums.tangent);
  ASSERT_TRUE(factor.factorise(body.sums.tangent));
  Eigen::VectorXd creeping;
  factor.solve(-body.sums.residual, creeping);
  NewtonDirection direction(body.mechanics);
  body.evaluate(state);
  ASSERT_TRUE(direction.deformed(state, 1e-3, 10, body.sums, step));
  body.evaluate(state);
  // What energy and forces, both to second order, say of a step.
  const auto fall = [&](const Eigen::VectorXd& s) { return -slope(s) - 0.5 * s.dot(body.sums.tangent * s); };
  EXPECT_GT(fall(creeping), 0);
  EXPECT_GT(fall(step), fall(creeping));
}

TEST_F(SqueezedDome, AKeptFactorOfTheChangedTangentServesAgainNearTheAnswer) {
  const State state{x, scene.mesh.points};
  NewtonDirection direction(body.mechanics);
  ASSERT_TRUE(direction.deformed(state, 1e-3, 10, body.sums, step));
  body.evaluate(state);
  const double norm = step.norm();
  ASSERT_TRUE(direction.deformed(state, 1e-3, 0.5, body.sums, step));
  EXPECT_LT(slope(step), 0);
  EXPECT_NEAR(step.norm(), norm, 1e-6 * norm);
  EXPECT_EQ(direction.factorisations(), 2) << "no further one";
}

}  // namespace
}  // namespace supine::simulation
