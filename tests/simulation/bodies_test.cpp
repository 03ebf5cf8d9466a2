// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "common/error.h"
#include "meshing/supports.h"
#include "meshing/topology.h"
#include "simulation/model_fields.h"
#include "simulation/parameters.h"
#include "simulation/solve/chain.h"
#include "simulation/solve/sensitivities.h"
#include "tests/simulation/effects/effect_scene.h"
#include "tests/simulation/scene.h"
#include "tests/support/taylor.h"

// Bodies that are no prone breast: other imaged poses, objects on named supports.
namespace supine::simulation {
namespace {

using testing::effect;

const Eigen::Vector3d down(0, -1, 0);

Model rubber(double young_modulus_kpa) {
  Model model;
  model.breast.young_modulus_kpa.value = young_modulus_kpa;
  model.breast.poisson_ratio.value = 0.49;
  model.skin.young_modulus_kpa.value = 0;
  model.interface.kind = InterfaceKind::fixed;
  return model;
}

double largest(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

/// The undeformed shape that is found of a body imaged as it lies in one pose.
Points undeformed_of(const testing::TestScene& scene, const Model& model, const PoseLoad& imaged, const Points& x) {
  meshing::TetMesh mesh = scene.mesh;
  mesh.points = x;
  meshing::Anatomy anatomy = scene.anatomy;
  anatomy.imaged_pose = imaged.name;
  const ChainSolution solution = solve_chain(mesh, anatomy, model, {imaged});
  EXPECT_LE(solution.round_trip_max_mm, 1e-6) << imaged.name;
  EXPECT_GT(largest(solution.X, x), 1) << imaged.name;
  return solution.X;
}

TEST(ImagedPose, EqualBodiesImagedSupineAndUprightHaveTheSameUndeformedShape) {
  testing::TestScene scene = testing::dome_scene();
  scene.anatomy.imaged_pose = free_of_load;
  Model model = testing::soft_model();
  model.breast.young_modulus_kpa.value = 1.5;
  model.breast.density_refers_to = DensityReference::undeformed;
  const PoseLoad supine{"supine", {0, 1, 0}}, upright{"upright", {0, 0, -1}};
  const ChainSolution lying =
      solve_chain(scene.mesh, scene.anatomy, model, {{free_of_load, Eigen::Vector3d::Zero()}, supine, upright});
  const Points a = undeformed_of(scene, model, supine, lying.poses[0].x);
  const Points b = undeformed_of(scene, model, upright, lying.poses[1].x);
  EXPECT_LT(largest(a, b), 1e-5);
  EXPECT_LT(largest(a, scene.mesh.points), 1e-5);
}

TEST(ImagedPose, FreeOfLoadIsTheUndeformedShapeAsItStands) {
  const testing::TestScene scene = testing::bar_scene(100, 20, 6, 2);
  const ChainSolution solution =
      solve_chain(scene.mesh, scene.anatomy, rubber(300), {{free_of_load, Eigen::Vector3d::Zero()}, {"hanging", down}});
  EXPECT_EQ(solution.X, scene.mesh.points);
  EXPECT_EQ(solution.inverse.newton_iterations, 0);
  EXPECT_EQ(solution.round_trip_max_mm, 0);
  EXPECT_GT(largest(solution.poses[0].x, solution.X), 5);
}

TEST(ImagedPose, WithoutGravityNothingMoves) {
  testing::TestScene scene = testing::bar_scene(100, 20, 4, 1);
  scene.anatomy.imaged_pose = "buoyant";
  const ChainSolution solution =
      solve_chain(scene.mesh, scene.anatomy, rubber(300), {{"buoyant", Eigen::Vector3d::Zero()}, {"hanging", down}});
  EXPECT_LT(largest(solution.X, scene.mesh.points), 1e-9);
  EXPECT_LT(solution.round_trip_max_mm, 1e-9);
}

// An end of what bodies may be: nearly incompressible hard rubber without a skin.

TEST(Rubber, OfTenMegapascalBendsAsABeamDoes) {
  constexpr double length = 100, width = 20, young_kpa = 1e4;
  const testing::TestScene scene = testing::bar_scene(length, width, 10, 2);
  Model model = rubber(young_kpa);
  model.breast.poisson_ratio.value = 0.4995;
  const ChainSolution solution =
      solve_chain(scene.mesh, scene.anatomy, model, {{free_of_load, Eigen::Vector3d::Zero()}, {"hanging", down}});
  // q L⁴ / 8 E I of bending and 1.2 q L² / 2 G A of shear, G = E/3.
  const double load = 1000e-9 * 9810 * width * width, inertia = std::pow(width, 4) / 12;
  const double beam = load * std::pow(length, 4) / (8 * young_kpa * inertia) +
                      1.2 * load * length * length / (2 * young_kpa / 3 * width * width);
  const double falls = -(solution.poses[0].x - scene.mesh.points).col(1).minCoeff();
  // The clamp keeps the section from narrowing, so that the bar is a little shorter than the beam.
  EXPECT_LT(falls, beam);
  EXPECT_GT(falls, 0.9 * beam);
}

TEST(ImagedPose, AChainThatStartsElsewhereIsRefused) {
  const testing::TestScene scene = testing::bar_scene(100, 20, 4, 1);
  EXPECT_THROW(Chain(scene.mesh, scene.anatomy, rubber(300), {{"prone", down}}), InputError);
}

/// What a support does on the mean: shift, and turn as a rotation vector, of its points from X to x.
struct Motion {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
};

/// By quadrature over the support's faces, as the springs carry force and moment.
Motion motion_of(const testing::TestScene& scene, const Points& x) {
  const auto of_face = meshing::support_of_faces(scene.mesh);
  const auto area = meshing::support_area(scene.mesh, of_face, 0);
  const Points moved = x - scene.mesh.points;
  Motion motion;
  for (Eigen::Index f = 0; f < scene.mesh.faces.rows(); ++f) {
    if (of_face[f] < 0) continue;
    const double a = meshing::face_area_mm2(scene.mesh.points, scene.mesh.faces, f);
    // A degree 5 rule (Strang and Fix): displacement times place is of degree 3.
    static const double b1 = 0.059715871789770, b2 = 0.470142064105115, c1 = 0.797426985353087, c2 = 0.101286507323456;
    const double points[7][4] = {{1.0 / 3, 1.0 / 3, 1.0 / 3, 0.225}, {b1, b2, b2, 0.132394152788506},
                                 {b2, b1, b2, 0.132394152788506},    {b2, b2, b1, 0.132394152788506},
                                 {c1, c2, c2, 0.125939180544827},    {c2, c1, c2, 0.125939180544827},
                                 {c2, c2, c1, 0.125939180544827}};
    for (const auto& p : points) {
      const double l[3] = {p[0], p[1], p[2]};
      double shape[6];
      for (int k = 0; k < 3; ++k) shape[k] = l[k] * (2 * l[k] - 1), shape[3 + k] = 4 * l[k] * l[(k + 1) % 3];
      Eigen::Vector3d u = Eigen::Vector3d::Zero(), at = Eigen::Vector3d::Zero();
      for (int k = 0; k < 6; ++k) {
        u += shape[k] * moved.row(scene.mesh.faces(f, k)).transpose();
        at += shape[k] * scene.mesh.points.row(scene.mesh.faces(f, k)).transpose();
      }
      const double weight = a * p[3];
      motion.shift += weight / area.area_mm2 * u;
      motion.turn += weight / area.bending_mm4 * (at - area.centroid_mm).cross(u);
    }
  }
  return motion;
}

TEST(SupportCompliance, TurnsByItsMomentAndShiftsByItsForce) {
  const testing::TestScene scene = testing::bar_scene(100, 20, 6, 2);
  Model model = rubber(5000);  // hardly bends: the moment is that of the straight bar
  model.breast.density_kg_m3.value = 100;
  const double turn_deg_per_nm = 50, across = 3;
  model.effects = {effect("support_compliance", {{"turn_deg_per_nm", turn_deg_per_nm}, {"across", across}})};
  const ChainSolution solution =
      solve_chain(scene.mesh, scene.anatomy, model, {{free_of_load, Eigen::Vector3d::Zero()}, {"hanging", down}});
  const Motion motion = motion_of(scene, solution.poses[0].x);
  const double force_n = 100e-9 * 20 * 20 * 100 * 9.81, moment_nm = force_n * 0.05;
  // c ∫y² dA / A of a square of 20 mm: c × 20² / 12, and 1 deg/(N m) is π/180 × 1e-3 1/N mm.
  const double shift = across * turn_deg_per_nm * std::numbers::pi / 180 * 1e-3 * 400 / 12 * force_n;
  EXPECT_NEAR(-motion.shift.y(), shift, 1e-3 * shift);
  const double turn_deg = motion.turn.z() * 180 / std::numbers::pi;  // the free end, at -x, goes down
  EXPECT_NEAR(turn_deg, turn_deg_per_nm * moment_nm, 2e-3 * turn_deg_per_nm * moment_nm);
}

/// Stiffness along the normal under each support of two: a clamp that is fixed, a table of another kind.
std::vector<double> stiffness_under(const testing::TestScene& scene, const Model& model) {
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  const auto fields = values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "supine"}, down));
  const Eigen::Index points = fields.interface_normal.size() / layout.support_begin.back();
  return {fields.interface_normal[0], fields.interface_normal[points * layout.support_begin[1]]};
}

TEST(SupportCompliance, OfAllSupportsThoseThatSlideAreLeftAlone) {
  testing::TestScene scene = testing::dome_scene();
  scene.mesh.support_names = {"clamp", "table"};
  scene.mesh.muscle_support.resize(scene.mesh.muscle.triangles.rows());
  for (Eigen::Index t = 0; t < scene.mesh.muscle_support.size(); ++t)
    scene.mesh.muscle_support[t] = scene.mesh.muscle.points(scene.mesh.muscle.triangles(t, 0), 0) > 0;
  Model model = testing::soft_model();
  const Effect& compliance = *find_effect("support_compliance");
  EXPECT_FALSE(compliance.belongs_to(scene.mesh, scene.anatomy, model)) << "everything slides";
  model.supports["clamp"].kind = InterfaceKind::fixed;
  EXPECT_TRUE(compliance.belongs_to(scene.mesh, scene.anatomy, model));
  const std::vector<double> before = stiffness_under(scene, model);
  model.effects = {effect("support_compliance", {{"turn_deg_per_nm", 50}})};
  const std::vector<double> all = stiffness_under(scene, model);
  EXPECT_LT(all[0], 0.1 * before[0]);
  EXPECT_EQ(all[1], before[1]);
  model.effects[0].options["support"] = "clamp";
  EXPECT_EQ(stiffness_under(scene, model), all);
  model.effects[0].options["support"] = "table";
  EXPECT_THROW(stiffness_under(scene, model), InputError);
  model.supports["table"].kind = InterfaceKind::elastic;
  EXPECT_LT(stiffness_under(scene, model)[1], before[1]);
}

TEST(SupportCompliance, AFixedSupportHoldsWithoutIt) {
  const testing::TestScene scene = testing::bar_scene(100, 20, 6, 2);
  const ChainSolution solution =
      solve_chain(scene.mesh, scene.anatomy, rubber(300), {{free_of_load, Eigen::Vector3d::Zero()}, {"hanging", down}});
  const Motion motion = motion_of(scene, solution.poses[0].x);
  EXPECT_LT(motion.shift.norm(), 1e-4);
  EXPECT_LT(motion.turn.norm() * 180 / std::numbers::pi, 1e-4);
}

TEST(PartStiffness, ASofterPartIsAnotherModulusThere) {
  const testing::TestScene scene = testing::bar_scene(100, 20, 2, 1);
  const Layout layout = make_layout(scene.mesh, scene.anatomy);
  Model model = rubber(300);
  model.effects = {effect("part_stiffness", {{"log_ratio", -std::numbers::ln2}})};
  model.effects[0].options["part"] = "right";
  const auto fields = values_of(make_fields(model, {scene.mesh, scene.anatomy, layout, "hanging"}, down));
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c)
    EXPECT_NEAR(std::exp(fields.ln_young[c]), scene.mesh.part_fraction(c, 1) == 1 ? 150 : 300, 1e-9);
  model.effects[0].options["part"] = "middle";
  EXPECT_THROW(make_fields(model, {scene.mesh, scene.anatomy, layout, "hanging"}, down), InputError);
}

TEST(ObjectSensitivities, AreExactForABodyImagedFreeOfLoad) {
  const testing::TestScene scene = testing::bar_scene(100, 20, 4, 1);
  Model model = rubber(300);
  model.effects = {effect("support_compliance", {{"turn_deg_per_nm", 40}, {"across", 5}}),
                   effect("part_stiffness", {{"log_ratio", 0.4}})};
  const std::vector<PoseLoad> poses = {{free_of_load, Eigen::Vector3d::Zero()}, {"hanging", down}};
  Chain chain(scene.mesh, scene.anatomy, model, poses);
  const ChainSolution at = chain.solve(model);
  const Sensitivities sensitivities(chain, model, at);
  for (const char* name : {"breast.young_modulus_kpa", "support_compliance.turn_deg_per_nm",
                           "support_compliance.across", "part_stiffness.log_ratio"}) {
    const ChainDerivative slope = sensitivities.of(name);
    EXPECT_EQ(slope.X.norm(), 0) << name;
    const double size = find_setting(model, name)->value;
    const auto shape = [&](double step) -> Eigen::VectorXd {
      Model there = model;
      find_setting(there, name)->value += size * step;
      const Points x = chain.solve(there, &at).poses[0].x;
      return Eigen::Map<const Eigen::VectorXd>(x.data(), x.size());
    };
    const Eigen::VectorXd along =
        size * Eigen::Map<const Eigen::VectorXd>(slope.poses[0].data(), slope.poses[0].size());
    EXPECT_GT(testing::taylor_order(shape, along, 0.05), 1.9) << name;
  }
}

TEST(Supports, SeveralAreHeldEachInItsOwnWay) {
  testing::TestScene scene = testing::bar_scene(100, 20, 4, 1);
  // The far end rests on a second support: its faces and its sheet.
  const Eigen::Index sheet = scene.mesh.muscle.triangles.rows(), points = scene.mesh.muscle.points.rows();
  scene.mesh.muscle.triangles.conservativeResize(2 * sheet, 3);
  scene.mesh.muscle.points.conservativeResize(2 * points, 3);
  for (Eigen::Index p = 0; p < points; ++p)
    scene.mesh.muscle.points.row(points + p) =
        Eigen::RowVector3d(-100, scene.mesh.muscle.points(p, 1), scene.mesh.muscle.points(p, 2));
  for (Eigen::Index t = 0; t < sheet; ++t)
    scene.mesh.muscle.triangles.row(sheet + t) =
        scene.mesh.muscle.triangles.row(t).reverse().array() + static_cast<int>(points);
  for (Eigen::Index f = 0; f < scene.mesh.faces.rows(); ++f)
    if (scene.mesh.points(scene.mesh.faces.row(f), 0).maxCoeff() < -99.9)
      scene.mesh.region[f] = static_cast<int>(reconstruction::Region::inner);
  scene.mesh.support_names = {"clamp", "rest"};
  scene.mesh.muscle_support.resize(2 * sheet);
  scene.mesh.muscle_support << Eigen::VectorXi::Zero(sheet), Eigen::VectorXi::Ones(sheet);
  scene.anatomy = meshing::compute_anatomy(scene.mesh, "none", "undeformed");
  const std::vector<PoseLoad> poses = {{free_of_load, Eigen::Vector3d::Zero()}, {"hanging", down}};
  const auto end_falls = [&](InterfaceKind kind) {
    Model model = rubber(300);
    model.supports["rest"].kind = kind;
    model.supports["rest"].normal_kpa_per_mm = model.supports["rest"].tangential_kpa_per_mm = 0.05;
    const Points x = solve_chain(scene.mesh, scene.anatomy, model, poses).poses[0].x;
    double sum = 0;
    int count = 0;
    for (Eigen::Index p = 0; p < x.rows(); ++p)
      if (scene.mesh.points(p, 0) < -99.9) sum += scene.mesh.points(p, 1) - x(p, 1), ++count;
    return sum / count;
  };
  const double fixed = end_falls(InterfaceKind::fixed), elastic = end_falls(InterfaceKind::elastic),
               sliding = end_falls(InterfaceKind::sliding);
  EXPECT_LT(fixed, 1e-3);
  EXPECT_GT(elastic, 0.5);
  EXPECT_GT(sliding, 0.5);
  Model model = rubber(300);
  model.supports["shelf"].kind = InterfaceKind::fixed;
  EXPECT_THROW(Chain(scene.mesh, scene.anatomy, model, poses), InputError);
}

TEST(Supports, ABreastMayHaveSeveral) {
  const testing::TestScene& plain = testing::dome_scene();
  testing::TestScene named = plain;
  named.mesh.support_names = {"muscle", "port"};
  named.mesh.muscle_support.resize(named.mesh.muscle.triangles.rows());
  for (Eigen::Index t = 0; t < named.mesh.muscle_support.size(); ++t)
    named.mesh.muscle_support[t] = named.mesh.muscle.points(named.mesh.muscle.triangles(t, 0), 0) > 20;
  const std::vector<PoseLoad> poses = {{"prone", {0, -1, 0}}, {"supine", {0, 1, 0}}};
  Model model = testing::soft_model();
  const Points one = solve_chain(plain.mesh, plain.anatomy, model, poses).poses[0].x,
               two = solve_chain(named.mesh, named.anatomy, model, poses).poses[0].x;
  EXPECT_LT(largest(one, two), 1e-5) << "all slide as one muscle";
  model.supports["port"].kind = InterfaceKind::fixed;
  const Points held = solve_chain(named.mesh, named.anatomy, model, poses).poses[0].x;
  const Eigen::VectorXi support = meshing::support_of_faces(named.mesh);
  double on_port = 0, on_muscle = 0;
  for (Eigen::Index f = 0; f < support.size(); ++f)
    for (const int node : named.mesh.faces.row(f)) {
      const double moved = (held.row(node) - named.mesh.points.row(node)).norm();
      if (support[f] == 1) on_port = std::max(on_port, moved);
      if (support[f] == 0) on_muscle = std::max(on_muscle, moved);
    }
  EXPECT_LT(on_port, 1e-3);
  EXPECT_GT(on_muscle, 1);
}

}  // namespace
}  // namespace supine::simulation
