// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SparseLU>
#include <cmath>

#include "simulation/elements/elements.h"
#include "simulation/elements/tet_geometry.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"
#include "simulation/solve/equilibrium.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::random_matrix;

struct Case {
  int order;
  BulkLaw law;
  double poisson = 0.45;
};

class PatchTest : public ::testing::TestWithParam<Case> {};

// Boundary nodes follow an affine map with a rotation by 63 degrees; the inside must find it by itself.
TEST_P(PatchTest, AffineMapWithARotationIsSolvedExactly) {
  testing::TestScene scene = testing::box_scene(3, {30, 30, 30});
  if (GetParam().order == 2) {
    scene.mesh = testing::quadratic(scene.mesh);
    scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
  }
  const auto nodes = static_cast<int>(scene.mesh.points.rows());
  std::vector<char> on_boundary(nodes, 0);
  for (Eigen::Index f = 0; f < scene.mesh.faces.rows(); ++f)
    for (const int n : scene.mesh.faces.row(f)) on_boundary[n] = 1;

  Model model = testing::soft_model(GetParam().law);
  model.breast.poisson_ratio.value = GetParam().poisson;
  model.skin.young_modulus_kpa.value = 0;
  model.interface.normal_kpa_per_mm.value = model.interface.tangential_kpa_per_mm.value = 0;
  model.cut.stiffness_kpa_per_mm.value = 0;
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  mechanics.set_fields(values_of(
      make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, Eigen::Vector3d::Zero())));

  const Matrix3 turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  Matrix3 affine = turn * (Matrix3::Identity() + 0.15 * random_matrix(3, 3, 4));
  const bool keeps_volume = GetParam().poisson > 0.45;
  if (keeps_volume) affine *= std::cbrt(1.002 / affine.determinant());  // as such tissue does
  const Points X = scene.mesh.points, exact = X * affine.transpose();
  Points x = exact;
  // mm; full Newton steps, so not too far in stiff tissue and in small elements
  const double start = keeps_volume ? 0.01 : GetParam().order == 2 ? 0.3 : 0.8;
  const Eigen::MatrixXd noise = random_matrix(nodes, 3, 5);
  for (int n = 0; n < nodes; ++n)
    if (!on_boundary[n]) x.row(n) += start * noise.row(n);
  ASSERT_GT((x - exact).norm(), 0.05);

  Sums sums(mechanics.pattern());
  for (int iteration = 0; iteration < 12; ++iteration) {
    mechanics.evaluate({x, X}, Demand{.residual = true, .tangent = true}, sums);
    ASSERT_TRUE(sums.valid);
    SparseMatrix k = sums.tangent;
    Eigen::VectorXd r = sums.residual;
    for (int c = 0; c < k.outerSize(); ++c)
      for (SparseMatrix::InnerIterator entry(k, c); entry; ++entry)
        if (on_boundary[c / 3] || on_boundary[entry.row() / 3]) entry.valueRef() = c == entry.row();
    for (int n = 0; n < nodes; ++n)
      if (on_boundary[n]) r.segment<3>(3 * n).setZero();
    const Eigen::SparseLU<SparseMatrix> solver(k);
    Eigen::Map<Eigen::VectorXd>(x.data(), x.size()) -= solver.solve(r);
  }
  EXPECT_LT((x - exact).rowwise().norm().maxCoeff(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    All, PatchTest,
    ::testing::Values(Case{1, BulkLaw::neo_hookean}, Case{1, BulkLaw::corotational}, Case{1, BulkLaw::corotational_qr},
                      Case{2, BulkLaw::neo_hookean}, Case{2, BulkLaw::corotational}, Case{1, BulkLaw::mooney_rivlin},
                      Case{1, BulkLaw::yeoh}, Case{1, BulkLaw::gent}, Case{1, BulkLaw::neo_hookean_calculix},
                      Case{2, BulkLaw::mooney_rivlin}, Case{2, BulkLaw::neo_hookean, 0.499},
                      Case{2, BulkLaw::neo_hookean_calculix, 0.499}, Case{2, BulkLaw::corotational, 0.499}));

// Whatever laws there are, on every element they go with.
std::vector<Case> every_law() {
  std::vector<Case> cases;
  for (const auto& [name, law] : bulk_law_names())
    for (const int order : {1, 2})
      if (order == 1 || law != BulkLaw::corotational_qr) cases.push_back(Case{order, law});
  return cases;
}
INSTANTIATE_TEST_SUITE_P(EveryLaw, PatchTest, ::testing::ValuesIn(every_law()));

// A column that hangs from z = 0 under its own weight. With ν = 0 the neo-Hookean law leaves its width alone and
// μ (F - 1/F) = ρ g (L - Z), so that F = (s + √(s² + 4))/2 with s = ρ g (L - Z)/μ.
double exact_displacement(double z, double length, double weight_over_mu) {
  const int steps = 400;  // Simpson
  double sum = 0;
  for (int i = 0; i <= steps; ++i) {
    const double s = weight_over_mu * (length - z * i / steps);
    const double f = 0.5 * (s + std::sqrt(s * s + 4)) - 1;
    sum += f * (i == 0 || i == steps ? 1 : (i % 2 ? 4 : 2));
  }
  return sum * z / steps / 3;
}

template <class Element>
double l2_error(const Indices& cells, const Points& x, const Points& X, double length, double weight_over_mu) {
  double sum = 0;
  for (int c = 0; c < cells.rows(); ++c) {
    const NodeRows<4> corners = gather<4>(X, cells, c);
    for (int p = 0; p < 4; ++p) {
      const auto point = tet_point<Tet4>(corners, 0);
      const auto& quadratic = Tet10::table().value[p];
      Eigen::Vector4d b;  // the rule's points: barycentric coordinates, from the quadratic corner functions b (2b - 1)
      for (int a = 0; a < 4; ++a)
        b[a] = 0.25 * (1 + std::sqrt(1 + 8 * quadratic[a])) > 0.5 ? 0.58541019662496845446 : 0.13819660112501051518;
      Eigen::Vector3d now, rest = corners.transpose() * b;
      if constexpr (Element::nodes == 4)
        now = gather<4>(x, cells, c).transpose() * b;
      else
        now = gather<10>(x, cells, c).transpose() * tet10_shape(b);
      const Eigen::Vector3d exact(0, 0, exact_displacement(rest.z(), length, weight_over_mu));
      sum += point.volume / 4 * (now - rest - exact).squaredNorm();
    }
  }
  return std::sqrt(sum);
}

double hanging_column_error(int n, int order) {
  const double length = 40;
  testing::TestScene scene = testing::box_scene(n, {20, 20, length});
  if (order == 2) {
    scene.mesh = testing::quadratic(scene.mesh);
    scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
  }
  Model model = testing::soft_model();
  model.breast.poisson_ratio.value = 0;
  model.breast.density_refers_to = DensityReference::undeformed;
  model.skin.young_modulus_kpa.value = 0;
  model.interface.kind = InterfaceKind::fixed;
  model.cut.stiffness_kpa_per_mm.value = 0;
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  mechanics.set_fields(values_of(
      make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics.layout(), "prone"}, Eigen::Vector3d::UnitZ())));
  EquilibriumSolver solver(mechanics);
  Points x;
  solver.forward(scene.mesh.points, x, "column");
  const double weight_over_mu = 1e-6 * gravity_mm_s2 / (0.8 / 2);
  return order == 1 ? l2_error<Tet4>(scene.mesh.cells, x, scene.mesh.points, length, weight_over_mu)
                    : l2_error<Tet10>(scene.mesh.cells, x, scene.mesh.points, length, weight_over_mu);
}

TEST(ConvergenceRate, HangingColumnIsSecondOrderLinearThirdOrderQuadratic) {
  for (const auto& [order, coarse] : {std::pair{1, 6}, std::pair{2, 2}}) {
    const double error = hanging_column_error(coarse, order), finer = hanging_column_error(2 * coarse, order);
    const double rate = std::log2(error / finer);
    EXPECT_GT(rate + 0.1, order + 1) << "order " << order << ": " << error << " → " << finer;
    EXPECT_LT(finer, order == 1 ? 10 : 0.2);
  }
}

}  // namespace
}  // namespace supine::simulation
