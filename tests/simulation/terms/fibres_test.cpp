// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/terms/fibres.h"

#include <gtest/gtest.h>

#include "simulation/mechanics.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::random_matrix;
using testing::taylor_order;

/// The fibre term alone on a scene, k_f the same everywhere.
template <class Element>
class Fibres {
 public:
  Fibres(const testing::TestScene& scene, double modulus_kpa)
      : pattern_(scene.mesh.cells, scene.mesh.points.rows()),
        sums(pattern_),
        term_(std::make_shared<const Elements>(scene.mesh.cells, pattern_), scene.anatomy.muscle) {
    Fields<double> fields;
    fields.fibre_modulus = Eigen::VectorXd::Constant(scene.mesh.cells.rows(), modulus_kpa);
    term_.set_fields(fields);
  }
  const Sums& at(const Points& x, const Points& X, const Demand& demand) {
    sums.clear(demand);
    term_.add({x, X}, demand, sums);
    return sums;
  }
  double energy(const Points& x, const Points& X) { return at(x, X, Demand{.energy = true}).energy; }
  Eigen::VectorXd force(const Points& x, const Points& X) { return at(x, X, Demand{.residual = true}).residual; }

 private:
  Pattern pattern_;

 public:
  Sums sums;

 private:
  FibreTerm<Element> term_;
};

// Muscle at z = 0: a = e_z, I4 = s² under a stretch s in z, so the energy is k/4 (s² - 1)² per volume.
TEST(Fibres, PullAlongTheMusclesNormalOnly) {
  const testing::TestScene scene = testing::box_scene(2, {60, 50, 40});
  Fibres<Tet4> fibres(scene, 0.6);
  const Points& X = scene.mesh.points;
  const auto stretched = [&X](const Eigen::RowVector3d& by) -> Points { return X.array().rowwise() * by.array(); };
  const double volume = 60 * 50 * 40, s = 1.3;
  EXPECT_NEAR(fibres.energy(stretched({1, 1, s}), X), volume * 0.15 * std::pow(s * s - 1, 2), 1e-4 * volume);
  EXPECT_NEAR(fibres.energy(stretched({s, 0.8, s}), X), volume * 0.15 * std::pow(s * s - 1, 2), 1e-4 * volume);
  EXPECT_LT(fibres.energy(stretched({s, s, 1}), X), 1e-6 * volume);
  EXPECT_EQ(fibres.energy(stretched({s, s, 0.9}), X), 0);
  EXPECT_EQ(fibres.force(stretched({s, s, 0.9}), X).norm(), 0);
}

TEST(Fibres, WithoutModulusDoNothingAtAll) {
  const testing::TestScene& scene = testing::dome_scene(2);
  Fibres<Tet10> fibres(scene, 0);
  const Demand everything{.energy = true, .residual = true, .tangent = true, .reference_tangent = true};
  const Sums& sums = fibres.at(1.2 * scene.mesh.points, scene.mesh.points, everything);
  EXPECT_EQ(sums.energy, 0);
  EXPECT_EQ(sums.residual.norm(), 0);
  EXPECT_EQ(sums.tangent.norm() + sums.reference_tangent.norm(), 0);
}

// A curved muscle, so that the direction turns with the undeformed place; taut throughout, as the energy has no second
// derivative where a fibre falls slack.
template <class Element>
void check_derivatives(const testing::TestScene& scene) {
  Fibres<Element> fibres(scene, 0.9);
  const int n = static_cast<int>(scene.mesh.points.rows());
  const Points X = scene.mesh.points + 0.1 * random_matrix(n, 3, 1), v = 0.3 * random_matrix(n, 3, 3);
  Points x = X + 0.1 * random_matrix(n, 3, 2);
  x.col(1) *= 1.2;
  const Eigen::VectorXd flat = Eigen::Map<const Eigen::VectorXd>(v.data(), v.size());
  const double slope = fibres.force(x, X).dot(flat);
  ASSERT_GT(std::abs(slope), 1e-3);
  EXPECT_GT(taylor_order([&](double h) { return fibres.energy(x + h * v, X); }, slope), 1.9);
  fibres.at(x, X, Demand{.tangent = true, .reference_tangent = true});
  const Eigen::VectorXd by_x = fibres.sums.tangent * flat, by_X = fibres.sums.reference_tangent * flat;
  ASSERT_GT(std::min(by_x.norm(), by_X.norm()), 1e-3);
  EXPECT_GT(taylor_order([&](double h) { return fibres.force(x + h * v, X); }, by_x), 1.9);
  EXPECT_GT(taylor_order([&](double h) { return fibres.force(x, X + h * v); }, by_X), 1.9);
}

TEST(Fibres, HaveExactDerivativesOnLinearCells) { check_derivatives<Tet4>(testing::dome_scene(1)); }
TEST(Fibres, HaveExactDerivativesOnQuadraticCells) { check_derivatives<Tet10>(testing::dome_scene(2)); }

}  // namespace
}  // namespace supine::simulation
