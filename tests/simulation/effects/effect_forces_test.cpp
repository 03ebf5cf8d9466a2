// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include "simulation/laws/contact_law.h"
#include "simulation/mechanics.h"
#include "simulation/model_fields.h"
#include "tests/simulation/effects/effect_scene.h"

// The forces of the effects' fields.
namespace supine::simulation {
namespace {

/// Forces of a box on which one field is set by hand.
struct LoadedBox {
  LoadedBox() : scene(testing::box_scene(2, {60, 50, 40})), model(testing::soft_model()) {
    model.cut.stiffness_kpa_per_mm.value = 1e-6;
    mechanics = std::make_unique<Mechanics>(scene.mesh, scene.anatomy, model);
    fields = values_of(
        make_fields(model, Scene{scene.mesh, scene.anatomy, mechanics->layout(), "supine"}, Eigen::Vector3d::Zero()));
    sums = std::make_unique<Sums>(mechanics->pattern());
  }
  Eigen::VectorXd residual(const Points& x, double load = 1) {
    mechanics->set_fields(fields);
    mechanics->evaluate({x, scene.mesh.points, load}, Demand{.residual = true}, *sums);
    return sums->residual;
  }
  Eigen::Vector3d total(const Points& x, double load = 1) {
    const Eigen::VectorXd r = residual(x, load);
    return Eigen::Map<const Points>(r.data(), x.rows(), 3).colwise().sum().transpose();
  }
  Points shifted(const Eigen::RowVector3d& by) const { return scene.mesh.points.rowwise() + by; }

  testing::TestScene scene;
  Model model;
  std::unique_ptr<Mechanics> mechanics;
  Fields<double> fields;
  std::unique_ptr<Sums> sums;
};

TEST(Traction, IsPressureTimesUndeformedArea) {
  LoadedBox box;
  const Eigen::Vector3d tau(0.3, -0.2, 0.1);
  box.fields.skin_traction = tau.replicate(box.mechanics->layout().skin.faces.size(), 1);
  const Points& X = box.scene.mesh.points;
  const Eigen::Vector3d expected = -60 * 50 * tau;
  EXPECT_LT((box.total(X) - expected).norm(), 1e-9);
  EXPECT_LT((box.total(X, 0.25) - 0.25 * expected).norm(), 1e-9);
  // A dead load: a body that is stretched carries no more.
  Points wide = X;
  wide.col(0) *= 1.2;
  const Eigen::VectorXd with = box.residual(wide);
  box.fields.skin_traction.setZero();
  const Eigen::VectorXd without = box.residual(wide);
  const Eigen::VectorXd difference = with - without;
  EXPECT_LT((Eigen::Map<const Points>(difference.data(), X.rows(), 3).colwise().sum().transpose() - expected).norm(),
            1e-8);
}

TEST(MuscleMotion, PushesWithTheSpringsStiffnessAndGrowsWithTheLoad) {
  LoadedBox box;
  box.fields.muscle_offset.setConstant(2);
  const Points& X = box.scene.mesh.points;
  for (const double load : {0.0, 0.5, 1.0})
    EXPECT_NEAR(box.total(X, load).z(), -load * 3.0 * 2 * 60 * 50, 1e-3 * 18000) << load;
  EXPECT_EQ(box.total(X, 0).z(), 0);
  EXPECT_LT(std::abs(box.total(box.shifted({0, 0, 2})).z()), 1e-3 * 18000) << "a body that moves along feels nothing";
}

TEST(Friction, IsCoulombsCoefficientTimesPressure) {
  LoadedBox box;
  box.model.interface.tangential_kpa_per_mm.value = 0;
  box.fields.interface_tangential.setZero();
  box.fields.interface_friction.setConstant(0.3);
  const double area = 60 * 50, pressure = 3.0 * 0.5 - 0.5 * friction_pressure_kpa;
  const double mobilised_share = 8 / std::sqrt(8 * 8 + friction_slip_mm * friction_slip_mm);
  const Eigen::Vector3d pressed = box.total(box.shifted({8, 0, -0.5}));
  EXPECT_NEAR(pressed.x(), 0.3 * pressure * area * mobilised_share, 2e-3 * 0.3 * pressure * area);
  EXPECT_NEAR(pressed.z(), -3.0 * 0.5 * area, 2e-3 * 1.5 * area);
  const Eigen::Vector3d pulled = box.total(box.shifted({8, 0, 0.5}));
  EXPECT_LT(std::abs(pulled.x()), 0.1) << "nothing rubs under tension";
}

TEST(Friction, TakesTheEnergyAwayOnlyWhileThereIsSome) {
  LoadedBox box;
  box.mechanics->set_fields(box.fields);
  EXPECT_TRUE(box.mechanics->has_energy());
  box.fields.interface_friction[3] = 0.1;
  box.mechanics->set_fields(box.fields);
  EXPECT_FALSE(box.mechanics->has_energy());
  box.fields.interface_friction.setZero();
  box.mechanics->set_fields(box.fields);
  EXPECT_TRUE(box.mechanics->has_energy());
}

TEST(Friction, PressureHasTheSlopeItStates) {
  for (const double z : {-0.3, 0.004, 0.013, 0.5}) {
    const double h = 1e-7;
    EXPECT_NEAR((contact_pressure(z + h) - contact_pressure(z - h)) / (2 * h), contact_pressure_slope(z), 1e-6);
  }
  EXPECT_EQ(contact_pressure(0.0), 0);
  EXPECT_NEAR(contact_pressure(friction_pressure_kpa * (1 + 1e-12)), 0.5 * friction_pressure_kpa, 1e-12);
}

TEST(SkinPrestretch, PullsAtTheEdgeWithTheMembranesTension) {
  for (const SkinLaw law : {SkinLaw::neo_hookean, SkinLaw::corotational}) {
    LoadedBox box;
    box.model.skin.law = law;
    Mechanics mechanics(box.scene.mesh, box.scene.anatomy, box.model);
    const double stretch = 1.1, modulus = 20 * 1.5;
    box.fields.skin_prestretch.setConstant(stretch);
    mechanics.set_fields(box.fields);
    const Points& X = box.scene.mesh.points;
    mechanics.evaluate({X, X}, Demand{.residual = true}, *box.sums);
    double pull = 0;
    for (Eigen::Index n = 0; n < X.rows(); ++n)
      if (X(n, 0) < 1e-9 && X(n, 2) > 40 - 1e-9) pull -= box.sums->residual[3 * n];
    // per undeformed length: h dW/dλ at equal stretches; plane stress E/(1-ν) (λ - 1) times the stretch for the other
    const double tension = law == SkinLaw::neo_hookean ? modulus / 3 * (stretch * stretch - std::pow(stretch, -4))
                                                       : modulus / (1 - 0.45) * (stretch - 1) * stretch;
    EXPECT_NEAR(pull, tension * 50, 1e-9 * tension * 50);
  }
}

}  // namespace
}  // namespace supine::simulation
