// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cstring>

#include "common/error.h"
#include "simulation/chain.h"
#include "simulation/contact_law.h"
#include "simulation/parameters.h"
#include "tests/simulation/scene.h"

namespace supine::simulation {
namespace {

using meshing::TetMesh;

const std::vector<PoseLoad> box_poses = {{"prone", {0.2, 0, std::sqrt(1 - 0.04)}},
                                         {"supine", -Eigen::Vector3d::UnitZ()}};

EffectSetting effect(const std::string& name, const std::map<std::string, double>& values) {
  EffectSetting setting = null_setting(*find_effect(name));
  for (const auto& [key, value] : values) setting.parameters.at(key).value = value;
  return setting;
}

bool same_bytes(const Points& a, const Points& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), sizeof(double) * a.size()) == 0;
}

Points moved(const Points& points, const Eigen::VectorXd& by) {
  return points + Eigen::Map<const Points>(by.data(), points.rows(), 3);
}

/// A box of some fat, some gland, some tumour on a plane muscle.
testing::TestScene mixed_box(int n) {
  testing::TestScene scene = testing::box_scene(n, {60, 60, 30});
  scene.mesh.fraction.setZero(scene.mesh.cells.rows(), segmentation::tissue_count);
  scene.mesh.fraction.col(static_cast<int>(segmentation::Tissue::adipose)).setConstant(0.5);
  scene.mesh.fraction.col(static_cast<int>(segmentation::Tissue::gland)).setConstant(0.4);
  scene.mesh.fraction.col(static_cast<int>(segmentation::Tissue::tumour)).setConstant(0.1);
  return scene;
}

/// The box taken for two breasts, parted in its middle.
void part(testing::TestScene& scene) {
  const meshing::Anatomy one = scene.anatomy;
  const double middle = scene.mesh.points.col(0).mean();
  scene.anatomy.side = "both";
  scene.anatomy.breasts = {one, one};
  scene.anatomy.breast = (scene.mesh.points.col(0).array() < middle).cast<int>();
}

class NullEffectTest : public ::testing::TestWithParam<const Effect*> {};

TEST_P(NullEffectTest, LeavesTheWholeChainByteForByte) {
  testing::TestScene scene = mixed_box(4);
  if (GetParam()->name() == "left_right_stiffness") part(scene);
  const Model without = testing::soft_model();
  Model with = without;
  with.effects = {null_setting(*GetParam())};
  const ChainSolution a = solve_chain(scene.mesh, scene.anatomy, without, box_poses);
  const ChainSolution b = solve_chain(scene.mesh, scene.anatomy, with, box_poses);
  EXPECT_TRUE(same_bytes(a.X, b.X));
  EXPECT_TRUE(same_bytes(a.poses[0].x, b.poses[0].x));
  EXPECT_TRUE(same_bytes(a.round_trip.x, b.round_trip.x));
}

INSTANTIATE_TEST_SUITE_P(Effects, NullEffectTest, ::testing::ValuesIn(catalogue()),
                         [](const auto& place) { return place.param->name(); });

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

TEST(Friction, HoldsTheBreastBackAndTheRoundTripStillCloses) {
  const testing::TestScene& scene = testing::dome_scene();
  const std::vector<PoseLoad> poses = {{"prone", -Eigen::Vector3d::UnitY()}, {"supine", Eigen::Vector3d(0.6, 0.8, 0)}};
  const auto slid = [&](double coefficient) {
    Model model = testing::soft_model();
    model.effects = {effect("friction", {{"coefficient", coefficient}})};
    const ChainSolution solution = solve_chain(scene.mesh, scene.anatomy, model, poses);
    EXPECT_LE(solution.round_trip_max_mm, 1e-6);
    const Layout layout = make_layout(scene.mesh, scene.anatomy);
    double sum = 0;
    for (const int face : layout.interface.faces)
      for (const int n : scene.mesh.faces.row(face)) sum += (solution.poses[0].x - solution.X).row(n).norm();
    return sum;
  };
  const double free = slid(0), little = slid(0.1), much = slid(0.5);
  EXPECT_LT(little, 0.98 * free);
  EXPECT_LT(much, 0.95 * little);
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

TEST(ArmTraction, PullsOnTheUpperOuterSkinInEveryPoseButProne) {
  const testing::TestScene& scene = testing::dome_scene();
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect("arm_traction", {{"lateral_kpa", 0.4}, {"head_kpa", 0.2}})};
  const auto at = [&](const char* pose) {
    return values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, pose}, {0, 1, 0})).skin_traction;
  };
  EXPECT_EQ(at("prone").norm(), 0);
  const Eigen::VectorXd traction = at("supine");
  const Eigen::Vector3d along = 0.4 * scene.anatomy.lateral + 0.2 * scene.anatomy.head;
  double largest = 0;
  for (Eigen::Index f = 0; f < layout.skin.faces.size(); ++f) {
    const Eigen::Vector3d t = traction.segment<3>(3 * f);
    EXPECT_LT(t.cross(along).norm(), 1e-12);
    if (layout.skin.q(f, 0) < 0.1 || layout.skin.q(f, 1) < 0.1) {
      EXPECT_EQ(t.norm(), 0);
    }
    largest = std::max(largest, t.norm() / along.norm());
  }
  EXPECT_GT(largest, 0.6);
  EXPECT_LE(largest, 1);
}

TEST(ChestWallMotion, MovesTheInnerSurfaceOutButNotInProne) {
  const testing::TestScene& scene = testing::dome_scene();
  const std::vector<PoseLoad> poses = {{"prone", -Eigen::Vector3d::UnitY()}, {"supine", Eigen::Vector3d::UnitY()}};
  Model model = testing::soft_model();
  const ChainSolution still = solve_chain(scene.mesh, scene.anatomy, model, poses);
  model.effects = {effect("chest_wall_motion", {{"amplitude_mm", 6}})};
  const ChainSolution out = solve_chain(scene.mesh, scene.anatomy, model, poses);
  EXPECT_TRUE(same_bytes(still.X, out.X));
  double highest = 0;
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  for (const int face : layout.interface.faces)
    for (const int n : scene.mesh.faces.row(face)) {
      const auto height = [&](const Points& x) { return scene.anatomy.muscle->value(x.row(n).transpose()); };
      const double rise = height(out.poses[0].x) - height(still.poses[0].x);
      if (scene.anatomy.q.row(n).norm() > 1.3) {
        EXPECT_LT(std::abs(rise), 0.6);
      }
      highest = std::max(highest, rise);
    }
  EXPECT_GT(highest, 5);
  EXPECT_LT(highest, 6.5);
}

TEST(Creep, SoftensProneAlone) {
  const testing::TestScene scene = mixed_box(2);
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect("creep", {{"log_softening", 0.3}})};
  const auto modulus = [&](const char* pose) {
    return std::exp(values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, pose}, {0, 1, 0})).ln_young[0]);
  };
  EXPECT_NEAR(modulus("supine"), 0.8, 1e-12);
  EXPECT_NEAR(modulus("prone") / modulus("supine"), std::exp(-0.3), 1e-12);
}

TEST(Misregistration, MovesTheScanAndNoShape) {
  const testing::TestScene scene = mixed_box(4);
  const Model without = testing::soft_model();
  Model with = without;
  with.effects = {effect("misregistration", {{"shift_x_mm", 4}, {"turn_z_rad", -0.1}})};
  const ChainSolution a = solve_chain(scene.mesh, scene.anatomy, without, box_poses);
  const ChainSolution b = solve_chain(scene.mesh, scene.anatomy, with, box_poses);
  EXPECT_TRUE(same_bytes(a.poses[0].x, b.poses[0].x));
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const auto motion = [&](const char* pose) {
    return values_of(make_fields(with, {scene.mesh, scene.anatomy, layout, pose}, {0, 1, 0})).scan_motion.eval();
  };
  Eigen::VectorXd expected(6);
  expected << 4, 0, 0, 0, 0, -0.1;
  EXPECT_EQ(motion("supine"), expected);
  EXPECT_EQ(motion("prone").norm(), 0);
}

class SegmentationOffsetTest : public ::testing::TestWithParam<int> {
 protected:
  SegmentationOffsetTest() : scene(testing::dome_scene(GetParam())), layout(make_layout(scene.mesh, scene.anatomy)) {}
  Eigen::VectorXd offset(double by_mm) const {
    Model model = testing::soft_model();
    model.effects = {effect("segmentation_offset", {{"offset_mm", by_mm}})};
    return values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "prone"}, {0, -1, 0})).imaged_offset;
  }
  const testing::TestScene& scene;
  Layout layout;
};

TEST_P(SegmentationOffsetTest, MovesTheSkinAlongItsNormalAndHoldsTheRest) {
  const TetMesh& mesh = scene.mesh;
  const Eigen::VectorXd by = offset(2);
  std::vector<char> held(mesh.points.rows(), 0);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    if (mesh.region[f] != static_cast<int>(reconstruction::Region::skin))
      for (const int n : mesh.faces.row(f)) held[n] = 1;
  const Eigen::Vector3d nipple = by.segment<3>(3 * scene.anatomy.nipple_point);
  EXPECT_NEAR(nipple.norm(), 2, 1e-12);
  EXPECT_GT(nipple.dot(scene.anatomy.outward), 1.8);
  double furthest = 0;
  for (Eigen::Index n = 0; n < mesh.points.rows(); ++n) {
    const double way = by.segment<3>(3 * n).norm();
    if (held[n]) {
      EXPECT_EQ(way, 0);
    }
    furthest = std::max(furthest, way);
  }
  EXPECT_LE(furthest, 2 + 1e-12) << "nodes inside move less than the skin does";
}

TEST_P(SegmentationOffsetTest, TurnsNothingInsideOut) {
  for (const double by_mm : {-3.0, 3.0}) {
    const Points there = moved(scene.mesh.points, offset(by_mm));
    EXPECT_GT(cell_det_f(scene.mesh.cells, there, scene.mesh.points).minCoeff(), 0.2) << by_mm;
  }
}

TEST_P(SegmentationOffsetTest, IsLinear) { EXPECT_LT((offset(2) + 2 * offset(-1)).norm(), 1e-12 * offset(2).norm()); }

INSTANTIATE_TEST_SUITE_P(Orders, SegmentationOffsetTest, ::testing::Values(1, 2));

TEST(SegmentationOffset, ChangesTheWeightWithTheImagedVolume) {
  const testing::TestScene& scene = testing::dome_scene();
  Model model = testing::soft_model();
  model.effects = {effect("segmentation_offset", {{"offset_mm", 1.5}})};
  Mechanics mechanics(scene.mesh, scene.anatomy, model);
  const auto fields = values_of(
      make_fields(model, {scene.mesh, scene.anatomy, mechanics.layout(), "supine"}, Eigen::Vector3d::UnitY()));
  mechanics.set_fields(fields);
  Sums sums(mechanics.pattern());
  const Points& X = scene.mesh.points;
  mechanics.evaluate({X, X}, Demand{.residual = true}, sums);
  const auto volume = [&scene](const Points& points) {
    double sum = 0;
    for (Eigen::Index c = 0; c < scene.mesh.cells.rows(); ++c) {
      const auto at = [&](int a) { return points.row(scene.mesh.cells(c, a)).transpose().eval(); };
      Eigen::Matrix3d edges;
      edges << at(1) - at(0), at(2) - at(0), at(3) - at(0);
      sum += edges.determinant() / 6;
    }
    return sum;
  };
  const double swollen = volume(moved(X, fields.imaged_offset));
  EXPECT_GT(swollen, 1.02 * volume(X));
  double weight = 0;
  for (Eigen::Index n = 0; n < X.rows(); ++n) weight -= sums.residual[3 * n + 1];
  EXPECT_NEAR(weight, 1e-6 * gravity_mm_s2 * swollen, 1e-9 * weight);
}

struct Refusal {
  std::string effect, why, pose;
  void (*change)(Model&);
};

class RefusalTest : public ::testing::TestWithParam<Refusal> {};

TEST_P(RefusalTest, NamesTheEffectAndTheReason) {
  const testing::TestScene scene = mixed_box(4);
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = testing::soft_model();
  model.effects = {effect(GetParam().effect, {})};
  check_effects_act(model, {scene.mesh, scene.anatomy, layout, "supine"});
  GetParam().change(model);
  try {
    check_effects_act(model, {scene.mesh, scene.anatomy, layout, GetParam().pose});
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'" + GetParam().effect + "'"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(GetParam().why), std::string::npos) << error.what();
  }
}

TEST(LeftRightStiffness, NeedsTwoBreasts) {
  testing::TestScene scene = mixed_box(2);
  Model model = testing::soft_model();
  model.effects = {null_setting(*find_effect("left_right_stiffness"))};
  const Layout one = make_layout(scene.mesh, scene.anatomy);
  EXPECT_THROW(check_effects_act(model, {scene.mesh, scene.anatomy, one, "supine"}), InputError);
  part(scene);
  const Layout two = make_layout(scene.mesh, scene.anatomy);
  EXPECT_NO_THROW(check_effects_act(model, {scene.mesh, scene.anatomy, two, "supine"}));
}

const auto keep = [](Model&) {};
const auto fix = [](Model& m) { m.interface.kind = InterfaceKind::fixed; };
const auto rotate_skin = [](Model& m) { m.skin.law = SkinLaw::corotational; };
const auto skin_off = [](Model& m) { m.skin.young_modulus_kpa.value = 0; };

INSTANTIATE_TEST_SUITE_P(All, RefusalTest,
                         ::testing::Values(Refusal{"friction", "interface.kind", "supine", fix},
                                           Refusal{"chest_wall_motion", "interface.kind", "supine", fix},
                                           Refusal{"skin_stiffening", "skin.law", "supine", rotate_skin},
                                           Refusal{"skin_prestretch", "skin.young_modulus_kpa", "supine", skin_off},
                                           Refusal{"creep", "prone is the only pose", "prone", keep},
                                           Refusal{"arm_traction", "prone is the only pose", "prone", keep},
                                           Refusal{"gravity_tilt", "prone is the only pose", "prone", keep}),
                         [](const auto& place) { return place.param.effect; });

}  // namespace
}  // namespace supine::simulation
