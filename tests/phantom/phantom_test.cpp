// SPDX-License-Identifier: AGPL-3.0-or-later
// The phantom's truth as a library: bodies, causes, equilibrium, labels, scans.
#include "phantom/phantom.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>

#include "common/error.h"
#include "meshing/surface/triangle_tree.h"
#include "meshing/topology.h"
#include "phantom/solve_poses.h"
#include "phantom/volunteers.h"
#include "phantom/voxels.h"
#include "simulation/catalogue.h"
#include "simulation/mechanics.h"
#include "simulation/model_fields.h"

namespace supine::phantom {
namespace {

constexpr int coarse_rings = 5;

PhantomOptions coarse(std::uint64_t seed) {
  PhantomOptions options;
  options.seed = seed;
  options.rings = coarse_rings;
  options.order = 1;
  options.voxel_mm = 3;
  return options;
}

TEST(Body, SeedsDifferAndMeshesStandOnTheMuscle) {
  EXPECT_NE(draw_body(1).height_mm, draw_body(2).height_mm);
  constexpr int rings = 9;  // middles of still larger cells may stay 0.2 mm off the muscle
  bool left = false, right = false;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Body body = draw_body(seed);
    (body.side == "left" ? left : right) = true;
    const BodyMesh made = mesh_body(body, seed, rings, 2);
    for (Eigen::Index c = 0; c < made.mesh.cells.rows(); ++c)
      ASSERT_GT(meshing::cell_volume_mm3(made.mesh.points, made.mesh.cells, c), 0) << "seed " << seed;
    // The lateral direction points to the patient's outer side, the nipple away from the chest.
    EXPECT_GT(made.anatomy.lateral.x() * (body.side == "left" ? 1 : -1), 0.5);
    EXPECT_LT(made.anatomy.outward.y(), -0.5);
    for (Eigen::Index f = 0; f < made.mesh.faces.rows(); ++f) {
      if (made.mesh.region[f] != static_cast<int>(reconstruction::Region::inner)) continue;
      for (const int node : made.mesh.faces.row(f)) {
        ASSERT_NEAR(made.anatomy.thickness_mm[node], 0, 0.1) << "seed " << seed;
      }
    }
  }
  EXPECT_TRUE(left && right);
}

// Cases that were made before must be made again: what the benchmark draws does not change.
TEST(Body, BenchmarkStaysAsItWas) {
  const Body body = draw_body(3);
  EXPECT_EQ(body.side, "left");
  EXPECT_NEAR(body.foot_radius_mm, 64.19032937274791, 1e-12);
  EXPECT_NEAR(body.height_mm, 38.6573484753337, 1e-12);
  EXPECT_NEAR(body.yaw_rad, 0.2330994133404684, 1e-12);
  EXPECT_NEAR(body.tumour_radius_mm, 7.573153567383695, 1e-12);
  EXPECT_NEAR(body.breast_kpa, 0.4896654702184056, 1e-12);
  EXPECT_NEAR(body.skin_kpa, 14.087915140113026, 1e-12);
}

TEST(Body, VolunteersLieInTheirRangesAndAreOtherBodies) {
  double lowest = 1e3, highest = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const Body body = draw_body(seed, Population::volunteers);
    const auto within = [seed](double value, double lower, double upper) {
      EXPECT_GE(value, lower) << "seed " << seed;
      EXPECT_LE(value, upper) << "seed " << seed;
    };
    within(body.foot_radius_mm, 55, 85);
    within(body.height_mm, 30, 110);
    within(body.breast_kpa, 0.2, 1);
    within(body.skin_kpa, 5, 40);
    lowest = std::min(lowest, body.height_mm);
    highest = std::max(highest, body.height_mm);
    EXPECT_EQ(body.side, draw_body(seed).side);
  }
  EXPECT_LT(lowest, 55);
  EXPECT_GT(highest, 100);
}

TEST(Volunteers, NipplesAreToMoveAsFarAsMeasuredOnes) {
  constexpr std::uint64_t draws = 2000;
  std::vector<double> way;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) way.push_back(draw_volunteer(seed).nipple_moves_mm);
  std::sort(way.begin(), way.end());
  // 63 volunteers; the error of a median of 2000 is 0.8 mm.
  EXPECT_NEAR(way[draws / 4], 80, 3);
  EXPECT_NEAR(way[draws / 2], 96, 3);
  EXPECT_NEAR(way[3 * draws / 4], 118, 4);
}

TEST(Volunteers, ModuliAreScaledUntilTheNippleMovesAsFarAsDrawn) {
  int reached = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    PhantomOptions options = coarse(seed);
    options.population = Population::volunteers;
    const Phantom made = make_phantom(options);
    const double off = std::abs(made.motion.nipple_mm.norm() / made.body.nipple_moves_mm - 1);
    reached += off <= 0.03;
    EXPECT_TRUE(off <= 0.03 || !made.gave_way.empty())
        << "seed " << seed << " is off by " << off << " and says nothing";
    EXPECT_GE(made.body.breast_kpa, softest_breast_kpa) << "seed " << seed;
    EXPECT_GE(made.body.skin_kpa, softest_skin_kpa) << "seed " << seed;
    EXPECT_EQ(made.body.height_mm, draw_volunteer(seed).height_mm);
  }
  EXPECT_GE(reached, 3);
}

// A twentieth of the stiffness that carries it, at once.
TEST(Volunteers, ShapesThatHaveNoneBesideThemAreKept) {
  PhantomOptions options = coarse(1);
  options.population = Population::volunteers;
  Phantom made = make_phantom(options);
  const BodyMesh body_mesh = mesh_body(made.body, options.seed, options.rings, options.order);
  const Points supine = made.poses[1].x;
  const double carried_kpa = made.body.breast_kpa;
  Body softer = made.body;
  softer.breast_kpa /= 20, softer.skin_kpa /= 20;
  try {
    solve_poses(body_mesh, softer, options, made, Truth::Start::shapes);
    FAIL() << "it is carried";
  } catch (const NumericalFailure& failure) {
    EXPECT_NE(std::string(failure.what()).find("no equilibrium beside that of stiffer tissue"), std::string::npos)
        << failure.what();
  }
  EXPECT_EQ(made.poses[1].x, supine);
  EXPECT_EQ(made.body.breast_kpa, carried_kpa);
}

TEST(Motion, IsThatOfAShiftedAndTurnedBody) {
  const Body body = draw_body(3, Population::volunteers);
  const BodyMesh made = mesh_body(body, 3, coarse_rings, 1);
  const Points& rest = made.mesh.points;
  const Eigen::RowVector3d shift(3, 4, 12);
  const Motion shifted = measure_motion(made, body, rest, rest.rowwise() + shift, 3);
  const double outer = body.side == "left" ? 1 : -1;
  EXPECT_LT((shifted.nipple_mm - Eigen::Vector3d(3 * outer, 4, 12)).norm(), 1e-9);
  EXPECT_EQ(shifted.inside.size(), 20u);
  for (const InnerPlace& place : shifted.inside) {
    EXPECT_NEAR(place.moved_mm, 13, 1e-9);
    EXPECT_NEAR(place.from_nipple_mm, 0, 1e-9);
    EXPECT_NEAR(place.skin_mm[0], place.skin_mm[1], 1e-9);
    EXPECT_GT(place.muscle_mm[0], -0.1);
    EXPECT_LT(place.muscle_mm[0] + place.skin_mm[0], 1.01 * body.height_mm);
  }
}

TEST(Causes, AreDrawnWithinTheCataloguesRanges) {
  for (const std::string& name : catalogue_causes()) {
    const simulation::Effect* effect = simulation::find_effect(name);
    ASSERT_NE(effect, nullptr) << name;
    for (std::uint64_t seed = 1; seed <= 50; ++seed)
      for (const auto& [key, value] : draw_cause(name, seed).values) {
        const auto& rows = effect->parameters();
        const auto row =
            std::find_if(rows.begin(), rows.end(), [&wanted = key](const auto& r) { return r.name == wanted; });
        ASSERT_NE(row, rows.end()) << name << "." << key;
        EXPECT_GE(value, row->lower) << name << "." << key;
        EXPECT_LE(value, row->upper) << name << "." << key;
      }
  }
  // left_right_stiffness needs two breasts, a phantom has one; part_stiffness and support_compliance need an object;
  // local_stiffness and local_muscle stand for causes that no effect lists.
  EXPECT_EQ(catalogue_causes().size() + 5, simulation::catalogue().size());
  for (const std::string& name : outside_causes()) EXPECT_EQ(simulation::find_effect(name), nullptr) << name;
}

struct Fields {
  BodyMesh body_mesh;
  Body body;
  simulation::Mechanics mechanics;
  explicit Fields(std::uint64_t seed)
      : body_mesh(mesh_body(draw_body(seed), seed, coarse_rings, 1)),
        body(draw_body(seed)),
        mechanics(body_mesh.mesh, body_mesh.anatomy, truth_model(body)) {}

  simulation::Fields<double> of(const std::string& pose, const std::vector<Cause>& causes) const {
    const simulation::Scene scene{body_mesh.mesh, body_mesh.anatomy, mechanics.layout(), pose};
    auto fields = simulation::values_of(simulation::make_fields(truth_model(body), scene, Eigen::Vector3d::UnitY()));
    for (const Cause& cause : causes) apply_cause(cause, {body, body_mesh.mesh, mechanics.layout(), pose}, fields);
    return fields;
  }
};

TEST(Causes, ChangeTheFieldsTheyShould) {
  const Fields scene(3);
  for (const auto& names : {catalogue_causes(), outside_causes()})
    for (const std::string& name : names) {
      const Cause cause = draw_cause(name, 3);
      bool changed = false;
      for (const char* pose : {"prone", "supine"}) {
        const auto with = scene.of(pose, {cause}), without = scene.of(pose, {});
        for (const auto& row : simulation::field_columns<double>) {
          EXPECT_EQ((with.*row.column).size(), (without.*row.column).size()) << name;
          changed = changed || (with.*row.column) != (without.*row.column);
        }
      }
      EXPECT_EQ(changed, name != "misregistration" && name != "segmentation_offset") << name;
    }
}

// Springs, fibres and stiffness of the truth carry nothing in the stress-free shape.
TEST(Truth, IsFreeOfForceWithoutGravity) {
  Fields scene(4);
  std::vector<Cause> causes;
  for (const char* name : {"ligament", "adhesion", "gland_stiffness", "fibre_anisotropy", "friction", "scar"})
    causes.push_back(draw_cause(name, 4));
  auto fields = scene.of("supine", causes);
  simulation::Sums sums(scene.mechanics.pattern());
  const simulation::Demand demand{.energy = false, .residual = true};
  const Points& rest = scene.body_mesh.mesh.points;
  scene.mechanics.set_fields(fields);
  scene.mechanics.evaluate({rest, rest, 1.0}, demand, sums);
  const double weight = sums.residual.norm();
  fields.gravity.setZero();
  scene.mechanics.set_fields(fields);
  scene.mechanics.evaluate({rest, rest, 1.0}, demand, sums);
  // The square roots in the skin's stretches keep half the digits at rest.
  EXPECT_LT(sums.residual.norm(), 1e-7 * weight);
}

TEST(Truth, EveryPoseIsAnEquilibrium) {
  Fields scene(5);
  const std::vector<Cause> causes = {draw_cause("ligament", 5), draw_cause("coil_contact", 5)};
  auto poses = truth_poses(true);
  Truth(scene.body_mesh, scene.body, causes, nullptr).solve(poses);
  ASSERT_EQ(poses.size(), 3u);
  simulation::Sums sums(scene.mechanics.pattern());
  const simulation::Demand demand{.energy = false, .residual = true};
  const Points& rest = scene.body_mesh.mesh.points;
  for (const TruthPose& pose : poses) {
    auto fields = scene.of(pose.name, causes);
    fields.gravity = simulation::gravity_mm_s2 * pose.gravity;
    scene.mechanics.set_fields(fields);
    scene.mechanics.evaluate({rest, rest, 1.0}, demand, sums);
    const double weight = sums.residual.norm();
    scene.mechanics.evaluate({pose.x, rest, 1.0}, demand, sums);
    EXPECT_LT(sums.residual.norm(), 1e-7 * weight) << pose.name;
    EXPECT_GT((pose.x - rest).rowwise().norm().maxCoeff(), 2) << pose.name;
  }
}

double tissue_ml(const segmentation::LabelImage& labels) {
  std::size_t count = 0;
  for (const std::uint8_t value : labels.voxels)
    count += value == static_cast<int>(Label::adipose) || value == static_cast<int>(Label::gland) ||
             value == static_cast<int>(Label::skin) || value == static_cast<int>(Label::tumour);
  return 1e-3 * static_cast<double>(count) * labels.grid.voxel_volume_mm3();
}

TEST(Labels, HoldTheBodysVolumeAndGrowWithTheSkin) {
  const Body body = draw_body(6);
  const BodyMesh made = mesh_body(body, 6, coarse_rings, 1);
  double volume = 0, skin_area = 0;
  for (Eigen::Index c = 0; c < made.mesh.cells.rows(); ++c)
    volume += 1e-3 * meshing::cell_volume_mm3(made.mesh.points, made.mesh.cells, c);
  for (Eigen::Index f = 0; f < made.mesh.faces.rows(); ++f)
    if (made.mesh.region[f] == static_cast<int>(reconstruction::Region::skin))
      skin_area += meshing::face_area_mm2(made.mesh.points, made.mesh.faces, f);
  const auto at = [&](double grown) { return tissue_ml(label_voxels(made, body, made.mesh.points, 6, {2, grown})); };
  EXPECT_NEAR(at(0), volume, 0.004 * volume);
  EXPECT_NEAR(at(1) - at(0), 1e-3 * skin_area, 0.12e-3 * skin_area);
  EXPECT_NEAR(at(0) - at(-1), 1e-3 * skin_area, 0.12e-3 * skin_area);
}

TEST(Labels, LeaveNoAirUnderABodyThatHangsOffTheMuscle) {
  const Body body = draw_body(6);
  const BodyMesh made = mesh_body(body, 6, coarse_rings, 1);
  const Eigen::RowVector3d off = 5 * made.anatomy.outward.transpose();
  Points hanging = made.mesh.points;
  for (Eigen::Index n = 0; n < hanging.rows(); ++n) {
    const Eigen::Vector3d local = body.local(hanging.row(n).transpose());
    hanging.row(n) += std::max(0.0, 1 - std::pow(body.in_foot_radii(local.head<2>()), 2)) * off;
  }
  const auto labels = label_voxels(made, body, hanging, 6, {2, 0});
  long air_under_tissue = 0, muscle_off = 0;
  for (int k = 0; k < labels.grid.size.z(); ++k)
    for (int i = 0; i < labels.grid.size.x(); ++i) {
      bool muscle = false, air = false;  // from the back (+y) to the front
      for (int j = labels.grid.size.y() - 1; j >= 0; --j) {
        const auto label = static_cast<Label>(labels.voxels[labels.grid.index(i, j, k)]);
        const Eigen::Vector3d at = labels.grid.point(Eigen::Vector3d(i, j, k));
        if (body.in_foot_radii(body.local(at).head<2>()) > 0.6) continue;
        muscle_off += label == Label::muscle && made.anatomy.muscle->value(at) > 2;
        if (label == Label::muscle)
          muscle = true;
        else if (label == Label::air)
          air = muscle;
        else
          air_under_tissue += air, air = false;
      }
    }
  EXPECT_EQ(air_under_tissue, 0);
  EXPECT_GT(muscle_off, 100);
}

TEST(Labels, HaveEveryTissueInEveryPhantom) {
  const Phantom phantom = make_phantom(coarse(7));
  std::array<std::size_t, 7> count{};
  for (const std::uint8_t value : phantom.contents.labels.voxels) ++count.at(value);
  for (std::size_t value = 0; value < count.size(); ++value) EXPECT_GT(count[value], 10u) << "label " << value;
}

TEST(Scan, HasTheNoiseItSays) {
  PhantomOptions options = coarse(8);
  options.noise_mm = 0;
  const Phantom exact = make_phantom(options);
  options.noise_mm = 0.7;
  const Phantom noisy = make_phantom(options);
  const auto& clean = exact.contents.poses[0].scan.surface;
  const auto& rough = noisy.contents.poses[0].scan.surface;
  ASSERT_EQ(clean.points.rows(), rough.points.rows());
  // 0.7 along the normal and 0.2 in each of three directions.
  const double rms = std::sqrt((rough.points - clean.points).squaredNorm() / static_cast<double>(clean.points.rows()));
  EXPECT_NEAR(rms, std::sqrt(0.49 + 3 * 0.04), 0.05);
}

TEST(Scan, MisregistrationIsTheRigidMotionItSays) {
  PhantomOptions options = coarse(9);
  const Phantom straight = make_phantom(options);
  options.effects = {"misregistration"};
  const Phantom moved = make_phantom(options);
  const Points& a = straight.contents.poses[0].scan.surface.points;
  const Points& b = moved.contents.poses[0].scan.surface.points;
  ASSERT_EQ(a.rows(), b.rows());
  const auto& values = moved.causes.front().values;
  const Eigen::RowVector3d shift = b.colwise().mean() - a.colwise().mean();
  EXPECT_NEAR(shift.x(), values.at("shift_x_mm"), 1e-9);
  EXPECT_NEAR(shift.y(), values.at("shift_y_mm"), 1e-9);
  EXPECT_NEAR(shift.z(), values.at("shift_z_mm"), 1e-9);
  // What is left is a turn about the centroid: lengths stay, and its size is that of the vector drawn.
  const Eigen::MatrixXd from = a.rowwise() - a.colwise().mean(), to = b.rowwise() - b.colwise().mean();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(from.transpose() * to, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::Matrix3d turn = svd.matrixV() * svd.matrixU().transpose();
  EXPECT_LT((to - from * turn.transpose()).norm(), 1e-6 * to.norm());
  const Eigen::Vector3d drawn(values.at("turn_x_rad"), values.at("turn_y_rad"), values.at("turn_z_rad"));
  EXPECT_NEAR(Eigen::AngleAxisd(turn).angle(), drawn.norm(), 1e-6);
  EXPECT_EQ(straight.contents.labels.voxels, moved.contents.labels.voxels);
}

TEST(Phantom, BodyAndNoiseDependOnTheSeedAlone) {
  PhantomOptions options = coarse(10);
  const Phantom null = make_phantom(options);
  options.effects = {"gravity_tilt"};
  const Phantom tilted = make_phantom(options);
  EXPECT_EQ(null.rest, tilted.rest);
  EXPECT_EQ(null.contents.labels.voxels, tilted.contents.labels.voxels);
  const Points &a = null.contents.poses[0].scan.surface.points, &b = tilted.contents.poses[0].scan.surface.points;
  EXPECT_FALSE(a.rows() == b.rows() && a == b);
}

TEST(PhantomRefuses, WhatCannotBeMade) {
  const auto refused = [](const std::function<void(PhantomOptions&)>& spoil) -> std::string {
    PhantomOptions options = coarse(1);
    spoil(options);
    try {
      make_phantom(options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const auto says = [](const std::string& message, const std::string& word) {
    EXPECT_NE(message.find(word), std::string::npos) << message;
  };
  says(refused([](auto& o) { o.noise_mm = 9; }), "noise_mm is 9");
  says(refused([](auto& o) { o.voxel_mm = 0.1; }), "voxel_mm is 0.1");
  says(refused([](auto& o) { o.rings = 2; }), "rings is 2");
  says(refused([](auto& o) { o.order = 3; }), "order is 3");
  says(refused([](auto& o) { o.effects = {"gremlins"}; }), "no cause 'gremlins'");
  says(refused([](auto& o) { o.effects = {"creep", "creep"}; }), "given twice");
  says(refused([](auto& o) { o.effects = {"creep", "ligament", "friction"}; }), "at most two");
  says(refused([](auto& o) {
         o.realistic = true;
         o.effects = {"creep", "ligament", "friction"};
         o.outside = {"scar"};
       }),
       "a realistic one three");
  says(refused([](auto& o) { o.size = 1.5; }), "size is 1.5");
  says(refused([](auto& o) { o.size = 0.5; }), "--size excludes a case without causes");
  says(refused([](auto& o) { o.prior = o.realistic = true; }), "--prior excludes --realistic");
  says(refused([](auto& o) {
         o.prior = true;
         o.effects = {"creep"};
       }),
       "--prior excludes --effect");
  says(refused([](auto& o) {
         o.prior = true;
         o.outside = {"scar"};
       }),
       "--prior excludes --outside");
  says(refused([](auto& o) {
         o.prior = true;
         o.size = 0.5;
       }),
       "--prior excludes --size");
  says(refused([](auto& o) { o.effects = {"scar"}; }), "--outside");
  says(refused([](auto& o) { o.outside = {"creep"}; }), "--effect");
}

}  // namespace
}  // namespace supine::phantom
