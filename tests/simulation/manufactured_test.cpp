// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "simulation/laws/bulk_laws.h"
#include "simulation/mechanics.h"
#include "simulation/model_fields.h"
#include "simulation/solve/linear_solver.h"
#include "tests/simulation/manufactured_problem.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

constexpr double size_mm = 40, young_kpa = 1, poisson = 0.3;

struct Case {
  BulkLaw law;
  int order;
  std::vector<int> meshes;  // cells along an edge, coarse to fine
};

/// The cube with its cells sheared and graded: regular meshes show rates that others do not have. Its faces stay.
testing::TestScene graded_cube(int n, int order) {
  testing::TestScene scene = testing::box_scene(n, Eigen::Vector3d::Constant(size_mm));
  for (Eigen::Index p = 0; p < scene.mesh.points.rows(); ++p) {
    const Eigen::RowVector3d at = scene.mesh.points.row(p) * (M_PI / size_mm);
    for (int i = 0; i < 3; ++i)
      scene.mesh.points(p, i) += 0.025 * size_mm * std::sin(at[i]) * std::cos(at[(i + 1) % 3] + 0.7 * at[(i + 2) % 3]);
  }
  if (order == 2) scene.mesh = testing::quadratic(scene.mesh);
  scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
  return scene;
}

/// The bulk term alone, held at z = 0.
Model bulk_only(BulkLaw law) {
  Model model = testing::soft_model(law);
  model.breast.young_modulus_kpa.value = young_kpa;
  model.breast.poisson_ratio.value = poisson;
  model.skin.young_modulus_kpa.value = 0;
  model.interface.kind = InterfaceKind::fixed;
  model.cut.stiffness_kpa_per_mm.value = 0;
  return model;
}

/// The discrete equilibrium r(x) = f, by Newton from the exact positions of the nodes.
Points solve(const testing::TestScene& scene, const Model& model, const testing::ManufacturedProblem& problem) {
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  mechanics.set_fields(values_of(
      make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, Eigen::Vector3d::Zero())));
  Eigen::VectorXd force = problem.external_forces(scene.mesh);
  for (Eigen::Index n = 0; n < scene.mesh.points.rows(); ++n)
    if (scene.mesh.points(n, 2) < 1e-9) force.segment<3>(3 * n).setZero();
  Points x = scene.mesh.points;
  for (Eigen::Index n = 0; n < x.rows(); ++n) x.row(n) = problem.map(scene.mesh.points.row(n)).transpose();
  Sums sums(mechanics.pattern());
  CholeskySolver solver(sums.tangent);
  double moved = 1;
  for (int iteration = 0; moved > 1e-10 * size_mm && iteration < 15; ++iteration) {
    mechanics.evaluate({x, scene.mesh.points}, Demand{.residual = true, .tangent = true}, sums);
    EXPECT_TRUE(solver.factorise(sums.tangent)) << "the exact solution is not a stable equilibrium";
    Eigen::VectorXd step = solver.solve(force - sums.residual);
    const Points before = x;
    do {
      x = before;
      Eigen::Map<Eigen::VectorXd>(x.data(), x.size()) += step;
      moved = step.cwiseAbs().maxCoeff();
      step *= 0.5;
    } while (cell_det_f(scene.mesh.cells, x, scene.mesh.points).minCoeff() <= 0.02 && moved > 1e-6);
  }
  EXPECT_LT(moved, 1e-10 * size_mm) << "Newton did not converge";
  return x;
}

class ManufacturedTest : public ::testing::TestWithParam<Case> {};

// Rates from the numbers of nodes, between neighbouring meshes; the last pair has to reach them, the others nearly.
TEST_P(ManufacturedTest, L2AndH1ErrorsFallAtTheElementsOrder) {
  const auto& [law, order, meshes] = GetParam();
  const testing::ManufacturedProblem problem(law, size_mm, young_kpa, poisson);
  double nodes_before = 0;
  testing::ManufacturedProblem::Errors before{};
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const testing::TestScene scene = graded_cube(meshes[m], order);
    const auto errors = problem.errors(scene.mesh, solve(scene, bulk_only(law), problem));
    const double nodes = std::cbrt(static_cast<double>(scene.mesh.points.rows()));
    if (m > 0) {
      const double steps = std::log((nodes - 1) / (nodes_before - 1));
      const double l2 = std::log(before.l2 / errors.l2) / steps, h1 = std::log(before.h1 / errors.h1) / steps;
      const double slack = m + 1 == meshes.size() ? 0.1 : 0.3;
      EXPECT_GE(l2, order + 1 - slack) << "n = " << meshes[m] << ": " << before.l2 << " → " << errors.l2;
      EXPECT_GE(h1, order - slack) << "n = " << meshes[m] << ": " << before.h1 << " → " << errors.h1;
      RecordProperty("l2_rate_" + std::to_string(meshes[m]), std::to_string(l2));
      RecordProperty("h1_rate_" + std::to_string(meshes[m]), std::to_string(h1));
    }
    before = errors;
    nodes_before = nodes;
  }
  const double volume = std::pow(size_mm, 3);
  EXPECT_LT(before.l2 / std::sqrt(volume), 0.01 * size_mm) << "root mean square error, mm";
}

INSTANTIATE_TEST_SUITE_P(All, ManufacturedTest,
                         ::testing::Values(Case{BulkLaw::neo_hookean, 1, {5, 10, 15}},
                                           Case{BulkLaw::neo_hookean, 2, {3, 5, 8}},
                                           Case{BulkLaw::corotational, 1, {5, 10, 15}},
                                           Case{BulkLaw::corotational, 2, {3, 5, 8}}));

// The map has to be a finite deformation, and its stress that of the engine's law.
TEST(ManufacturedProblem, DeformsAndTurnsAndHasTheLawsStress) {
  const Eigen::MatrixXd places = 0.5 * size_mm * (testing::random_matrix(60, 3, 8).array() + 1);
  double largest_turn = 0, largest_stretch = 0, smallest_j = 1;
  for (const BulkLaw law : {BulkLaw::neo_hookean, BulkLaw::corotational}) {
    const testing::ManufacturedProblem problem(law, size_mm, young_kpa, poisson);
    for (Eigen::Index p = 0; p < places.rows(); ++p) {
      const auto point = problem.at(places.row(p).transpose());
      const Matrix3 stress = bulk_stress<double>(law, point.f, bulk_material(young_kpa, poisson, 0.0),
                                                 Eigen::Matrix<double, 3, 2>::Identity());
      EXPECT_LT((stress - point.stress).norm(), 1e-10 * (1 + stress.norm()));
      const Matrix3 turn = polar_rotation(point.f);
      largest_turn = std::max(largest_turn, std::acos(0.5 * (turn.trace() - 1)));
      largest_stretch = std::max(largest_stretch, (turn.transpose() * point.f - Matrix3::Identity()).norm());
      smallest_j = std::min(smallest_j, point.f.determinant());
    }
  }
  EXPECT_GT(largest_turn, 0.6);
  EXPECT_GT(largest_stretch, 0.5);
  EXPECT_GT(smallest_j, 0.5);
}

// The body force is -Div P: the forces on a body as a whole balance against the traction on the held face.
TEST(ManufacturedProblem, BodyForceAndTractionsBalance) {
  const testing::ManufacturedProblem problem(BulkLaw::neo_hookean, size_mm, young_kpa, poisson);
  const testing::TestScene scene = graded_cube(6, 2);
  const Eigen::VectorXd force = problem.external_forces(scene.mesh);
  Eigen::Vector3d total = Eigen::Vector3d::Zero(), support = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < scene.mesh.points.rows(); ++n) total += force.segment<3>(3 * n);
  const int steps = 200;  // midpoint rule
  const double h = size_mm / steps;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) support -= h * h * problem.at({(i + 0.5) * h, (j + 0.5) * h, 0}).stress.col(2);
  EXPECT_GT(total.norm(), 1);
  EXPECT_LT((total + support).norm(), 1e-4 * total.norm());
}

}  // namespace
}  // namespace supine::simulation
