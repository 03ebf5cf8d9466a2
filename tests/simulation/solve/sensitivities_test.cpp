// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/sensitivities.h"

#include <gtest/gtest.h>
#include <omp.h>

#include "simulation/laws/bulk_laws.h"
#include "simulation/parameters.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::taylor_order;

const std::vector<PoseLoad> poses = {{"prone", {0, -1, 0}}, {"supine", {0, 1, 0}}, {"tilt", {0.6, 0.8, 0}}};

/// A dome in which every tissue effect finds something to act on.
testing::TestScene scene_with_tissues(int order) {
  testing::TestScene scene = testing::dome_scene(order);
  scene.mesh.fraction.setZero();
  for (Eigen::Index c = 0; c < scene.mesh.cells.rows(); ++c) {
    const double gland = 0.5 + 0.4 * std::sin(0.05 * static_cast<double>(c));
    scene.mesh.fraction(c, static_cast<int>(segmentation::Tissue::gland)) = gland;
    scene.mesh.fraction(c, static_cast<int>(segmentation::Tissue::tumour)) = 0.1;
    scene.mesh.fraction(c, static_cast<int>(segmentation::Tissue::adipose)) = 0.9 - gland;
  }
  testing::name_parts_and_support(scene.mesh);
  return scene;
}

Model with(Model model, const std::string& parameter, double value) {
  if (Setting* setting = find_setting(model, parameter)) {
    setting->value = value;
    return model;
  }
  EffectSetting effect = null_setting(*find_effect(parameter.substr(0, parameter.find('.'))));
  effect.parameters.at(parameter.substr(parameter.find('.') + 1)).value = value;
  model.effects.push_back(effect);
  return model;
}

Eigen::VectorXd stacked(const ChainSolution& s) {
  Eigen::VectorXd all(s.X.size() * static_cast<Eigen::Index>(1 + s.poses.size()));
  all.head(s.X.size()) = Eigen::Map<const Eigen::VectorXd>(s.X.data(), s.X.size());
  for (std::size_t p = 0; p < s.poses.size(); ++p)
    all.segment(s.X.size() * static_cast<Eigen::Index>(p + 1), s.X.size()) =
        Eigen::Map<const Eigen::VectorXd>(s.poses[p].x.data(), s.X.size());
  return all;
}

Eigen::VectorXd stacked(const ChainDerivative& d) {
  ChainSolution s;
  s.X = d.X;
  for (const Points& x : d.poses) s.poses.push_back({"", x, {}});
  return stacked(s);
}

struct Case {
  int order;
  BulkLaw law;
};

class SensitivitiesTest : public ::testing::TestWithParam<Case> {
 protected:
  SensitivitiesTest() : scene(scene_with_tissues(GetParam().order)), model(testing::soft_model(GetParam().law)) {
    model.breast.young_modulus_kpa.value = 1.5;
    // The tension field has a tangent that jumps where the skin begins to wrinkle, so that no step keeps second order.
    model.skin.compression = Compression::full;
    model.effects.push_back(null_setting(*find_effect("ligament")));
    model.effects.back().parameters.at("stiffness_kpa_per_mm").value = 0.3;
    chain = std::make_unique<Chain>(scene.mesh, scene.anatomy, model, poses);
    solution = chain->solve(model);
  }
  /// Every parameter there is: of the base model, of the effect present, of those at their null.
  std::vector<std::string> all_parameters() const {
    std::vector<std::string> names;
    for (const Parameter& row : base_parameters()) names.push_back(row.name);
    for (const Effect* effect : catalogue())
      for (const Parameter& row : effect->parameters()) names.push_back(parameter_name(*effect, row));
    return names;
  }
  /// One parameter of every term on quadratic elements, which take long; all of them on linear ones.
  std::vector<std::string> tested_parameters() const {
    if (GetParam().order == 1) return all_parameters();
    return {"breast.young_modulus_kpa",  "skin.young_modulus_kpa",        "ligament.stiffness_kpa_per_mm",
            "gland_stiffness.log_ratio", "segmentation_offset.offset_mm", "gravity_tilt.roll_rad"};
  }
  double value_of(const std::string& parameter) {
    if (const Setting* setting = find_setting(model, parameter)) return setting->value;
    return find_parameter(parameter)->null;
  }

  testing::TestScene scene;
  Model model;
  std::unique_ptr<Chain> chain;
  ChainSolution solution;
};

TEST_P(SensitivitiesTest, EveryParameterPassesATaylorTestThroughBothSolves) {
  const Sensitivities sensitivities(*chain, model, solution);
  const Eigen::VectorXd base = stacked(solution);
  int moving = 0;
  for (const std::string& name : tested_parameters()) {
    const ChainDerivative derivative = sensitivities.of(name);
    const Eigen::VectorXd slope = stacked(derivative);
    const double size = slope.cwiseAbs().maxCoeff();
    if (size < 1e-9) continue;  // counted below: what this model does not read
    ++moving;
    // A step that moves the worst node by a fiftieth of a millimetre.
    const double h = 0.02 / size, at = value_of(name);
    const auto shapes = [&](double s) -> Eigen::VectorXd {
      return s == 0 ? base : stacked(chain->solve(with(model, name, at + s), &solution));
    };
    const double order = taylor_order(shapes, slope, h, 1);
    EXPECT_GT(order, 1.9) << name << ", largest " << size << " mm per unit";
  }
  EXPECT_GE(moving, GetParam().order == 2 ? 6 : 20);
}

TEST_P(SensitivitiesTest, AreTheSameForAnyNumberOfThreads) {
  const std::vector<std::string> names = {"breast.young_modulus_kpa", "gravity_tilt.roll_rad"};
  const int before = omp_get_max_threads();
  std::vector<Eigen::VectorXd> shapes, slopes;
  for (const int threads : {1, 3}) {
    omp_set_num_threads(threads);
    Chain one(scene.mesh, scene.anatomy, model, poses);
    const ChainSolution there = one.solve(model);
    shapes.push_back(stacked(there));
    const Sensitivities sensitivities(one, model, there);
    for (const ChainDerivative& derivative : sensitivities.of(names)) slopes.push_back(stacked(derivative));
  }
  omp_set_num_threads(before);
  EXPECT_EQ(shapes[0], shapes[1]);
  EXPECT_EQ(slopes[0], slopes[2]);
  EXPECT_EQ(slopes[1], slopes[3]);
}

TEST_P(SensitivitiesTest, ManyAtATimeAreThoseOneByOne) {
  const Sensitivities sensitivities(*chain, model, solution);
  const std::vector<std::string> names = {"skin.young_modulus_kpa", "segmentation_offset.offset_mm"};
  const std::vector<ChainDerivative> many = sensitivities.of(names);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const Eigen::VectorXd one = stacked(sensitivities.of(names[k]));
    EXPECT_LT((stacked(many[k]) - one).norm(), 1e-10 * one.norm()) << names[k];
    EXPECT_EQ(many[k].prone, sensitivities.of(names[k]).prone);
  }
  const Eigen::VectorXd force = testing::random_matrix(static_cast<int>(solution.X.size()), 1, 3);
  const std::vector<Points> moved = sensitivities.moved_by(1, std::vector<Eigen::VectorXd>{force, -2 * force});
  EXPECT_LT((moved[0] - sensitivities.moved_by(1, force)).norm(), 1e-10 * moved[0].norm());
  EXPECT_LT((moved[1] + 2 * moved[0]).norm(), 1e-10 * moved[0].norm());
}

TEST_P(SensitivitiesTest, HoldsWithSkinThatWrinklesAndBendsToo) {
  model.skin.compression = Compression::tension_field;
  model.skin.bending_share = 100;
  Chain wrinkling(scene.mesh, scene.anatomy, model, poses);
  const ChainSolution base = wrinkling.solve(model);
  const Sensitivities sensitivities(wrinkling, model, base);
  for (const std::string name :
       {"breast.young_modulus_kpa", "skin.young_modulus_kpa", "skin.thickness_mm", "skin.compression_share"}) {
    const Eigen::VectorXd slope = stacked(sensitivities.of(name));
    const double h = 1e-3 / slope.cwiseAbs().maxCoeff(), at = value_of(name);
    const Eigen::VectorXd ahead = stacked(wrinkling.solve(with(model, name, at + h), &base));
    const Eigen::VectorXd behind = stacked(wrinkling.solve(with(model, name, at - h), &base));
    EXPECT_LT(((ahead - behind) / (2 * h) - slope).norm(), 2e-3 * slope.norm()) << name;
  }
}

TEST_P(SensitivitiesTest, AdjointGradientEqualsTheForwardOne) {
  const Sensitivities sensitivities(*chain, model, solution);
  const std::vector<std::string> names = all_parameters();
  std::vector<Points> weight;
  for (std::size_t p = 0; p < solution.poses.size(); ++p)
    weight.push_back(testing::random_matrix(static_cast<int>(solution.X.rows()), 3, static_cast<unsigned>(p)));
  const Eigen::VectorXd gradient = sensitivities.gradient(weight, names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const ChainDerivative derivative = sensitivities.of(names[i]);
    double forward = 0, size = 0;
    for (std::size_t p = 0; p < weight.size(); ++p) {
      forward += derivative.poses[p].cwiseProduct(weight[p]).sum();
      size += derivative.poses[p].norm() * weight[p].norm();
    }
    EXPECT_NEAR(gradient[static_cast<Eigen::Index>(i)], forward, 1e-9 * size) << names[i];
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, SensitivitiesTest,
                         ::testing::Values(Case{1, BulkLaw::neo_hookean}, Case{1, BulkLaw::corotational},
                                           Case{1, BulkLaw::corotational_qr}, Case{2, BulkLaw::neo_hookean}),
                         [](const auto& test) {
                           return std::string(name_of(test.param.law)) +
                                  (test.param.order == 2 ? "_quadratic" : "_linear");
                         });

}  // namespace
}  // namespace supine::simulation
