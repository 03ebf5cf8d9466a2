// SPDX-License-Identifier: AGPL-3.0-or-later
// What realistic phantoms and phantoms from the priors have beside their causes: fields, numbers, discrepancy.
#include "phantom/nuisances.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "common/error.h"
#include "phantom/cause_prior.h"
#include "phantom/discrepancy.h"
#include "phantom/phantom.h"
#include "simulation/catalogue.h"
#include "simulation/model_fields.h"
#include "simulation/parameters.h"

namespace supine::phantom {
namespace {

const std::vector<std::string> poses = {"supine", "tilt45"};

PhantomOptions coarse(std::uint64_t seed) {
  PhantomOptions options;
  options.seed = seed;
  options.rings = 5;
  options.order = 1;
  options.voxel_mm = 3;
  return options;
}

TEST(RandomField, HasTheSpreadAndTheCorrelationLengthItSays) {
  constexpr int draws = 3000;
  constexpr double sd = 0.7, length = 30;
  const Eigen::Vector3d here(12, -7, 40), way = Eigen::Vector3d(1, 2, -2) / 3;
  double square = 0, mean = 0, at_length = 0, at_twice = 0;
  for (int d = 0; d < draws; ++d) {
    const RandomField field(static_cast<std::uint64_t>(d), "test", sd, length);
    const double a = field.at(here);
    mean += a / draws;
    square += a * a / draws;
    at_length += a * field.at(here + length * way) / draws;
    at_twice += a * field.at(here + 2 * length * way) / draws;
  }
  // A mean of 3,000 products of two normal numbers is known to sd² √(2/3000).
  EXPECT_NEAR(mean, 0, 4 * sd / std::sqrt(draws));
  EXPECT_NEAR(square / (sd * sd), 1, 0.1);
  EXPECT_NEAR(at_length / (sd * sd), std::exp(-0.5), 0.1);
  EXPECT_NEAR(at_twice / (sd * sd), std::exp(-2), 0.1);
}

TEST(RandomField, DependsOnSeedAndName) {
  const Eigen::Vector3d here(1, 2, 3);
  EXPECT_EQ(RandomField(1, "a", 1, 20).at(here), RandomField(1, "a", 1, 20).at(here));
  EXPECT_NE(RandomField(1, "a", 1, 20).at(here), RandomField(1, "b", 1, 20).at(here));
  EXPECT_NE(RandomField(1, "a", 1, 20).at(here), RandomField(2, "a", 1, 20).at(here));
}

TEST(Nuisances, HaveTheSpreadOfTheirRows) {
  constexpr int draws = 2000;
  std::map<std::string, double> squares;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) {
    const Nuisances nuisances(seed, Nuisances::Kind::prior, {}, poses);
    EXPECT_EQ(nuisances.width(), 1);
    for (const NuisanceRow& row : nuisance_rows()) {
      const auto& numbers = row.of_pose ? nuisances.numbers_of("tilt45") : nuisances.numbers();
      squares[row.name] += std::pow(numbers.at(row.name) / row.sigma, 2) / draws;
    }
  }
  for (const NuisanceRow& row : nuisance_rows()) EXPECT_NEAR(squares.at(row.name), 1, 4 * std::sqrt(2.0 / draws));
}

TEST(Nuisances, OfRealisticCasesAreThreeTimesAsWideInATenth) {
  constexpr int draws = 2000;
  int wide = 0;
  double square = 0;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) {
    const Nuisances nuisances(seed, Nuisances::Kind::realistic, {}, poses);
    if (nuisances.width() == 1) continue;
    ++wide;
    EXPECT_EQ(nuisances.width(), 3);
    square += std::pow(nuisances.numbers_of("supine").at("shift_x_mm") / 2, 2);
    const double b = nuisances.numbers().at("stiffening_exponent");
    EXPECT_TRUE(b >= 0.08 && b <= 0.3) << b;
    EXPECT_GE(nuisances.numbers().at("log_incompressibility"), -2);
  }
  EXPECT_NEAR(wide, 200, 54);
  EXPECT_NEAR(square / wide, 9, 3);
}

TEST(Nuisances, ThatACauseStandsForAreLeftToIt) {
  const std::vector<Cause> causes = {draw_cause("adhesion", 3), draw_cause("gravity_tilt", 3)};
  const Nuisances with(3, Nuisances::Kind::prior, causes, poses), without(3, Nuisances::Kind::prior, {}, poses);
  EXPECT_EQ(with.numbers().at("log_tangential"), 0);
  EXPECT_NE(without.numbers().at("log_tangential"), 0);
  EXPECT_EQ(with.numbers().at("log_normal"), without.numbers().at("log_normal"));
  // One number for all poses widens what the poses share; each pose's own stays.
  EXPECT_EQ(with.numbers_of("supine"), without.numbers_of("supine"));
  EXPECT_NE(with.numbers_of("supine").at("gravity_roll_rad"), with.numbers_of("tilt45").at("gravity_roll_rad"));
}

TEST(Nuisances, SigmaIsThatOfTheCausesOwnParameters) {
  for (const std::string& name : catalogue_causes())
    for (const auto& [parameter, sigma] : nuisance_sigma(name)) {
      const auto& rows = simulation::find_effect(name)->parameters();
      EXPECT_TRUE(
          std::any_of(rows.begin(), rows.end(), [&name = parameter](const auto& row) { return row.name == name; }))
          << name << "." << parameter;
      EXPECT_GT(sigma, 0);
    }
  EXPECT_EQ(nuisance_sigma("misregistration").size(), 6u);
  EXPECT_NEAR(nuisance_sigma("misregistration").at("turn_x_rad"), 1.5 * std::numbers::pi / 180, 1e-15);
  EXPECT_TRUE(nuisance_sigma("ligament").empty());
}

struct Stand {
  Body body = draw_body(3);
  BodyMesh body_mesh = mesh_body(body, 3, 5, 1);
  simulation::Mechanics mechanics{body_mesh.mesh, body_mesh.anatomy, truth_model(body)};
  Stage stage(const char* pose) const { return {body, body_mesh.mesh, mechanics.layout(), pose}; }
  simulation::Fields<double> fields(const char* pose) const {
    const simulation::Scene scene{body_mesh.mesh, body_mesh.anatomy, mechanics.layout(), pose};
    return simulation::values_of(simulation::make_fields(truth_model(body), scene, Eigen::Vector3d::UnitY()));
  }
};

TEST(Nuisances, FieldsArePatchyButNotOnAverage) {
  const Stand stand;
  const simulation::Layout& layout = stand.mechanics.layout();
  constexpr int draws = 60;
  double tissue = 0, skin = 0;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) {
    const Nuisances nuisances(seed, Nuisances::Kind::prior, {draw_cause("gland_stiffness", seed)}, poses);
    auto fields = stand.fields("prone");
    const auto plain = fields;
    nuisances.apply(stand.stage("prone"), fields);
    const Eigen::VectorXd more = fields.ln_young - plain.ln_young;
    const Eigen::VectorXd stiffer = (fields.skin_modulus.array() / plain.skin_modulus.array()).log();
    EXPECT_NEAR(layout.skin.area_mm2.dot(stiffer), 0, 1e-8 * layout.skin.area_mm2.sum());
    EXPECT_EQ(fields.gravity, plain.gravity);
    EXPECT_EQ(fields.muscle_offset, plain.muscle_offset);
    tissue += more.squaredNorm() / static_cast<double>(more.size() * draws);
    skin += stiffer.squaredNorm() / static_cast<double>(stiffer.size() * draws);
  }
  // The average over the body, some correlation lengths wide, is taken out.
  EXPECT_NEAR(std::sqrt(tissue), 0.24, 0.02);
  EXPECT_NEAR(std::sqrt(skin), 0.145, 0.015);
}

TEST(Nuisances, TurnGravityAndMoveTheMuscleInEveryPoseButProne) {
  const Stand stand;
  const Nuisances nuisances(4, Nuisances::Kind::realistic, {}, poses);
  std::vector<Eigen::VectorXd> moved;
  for (const char* pose : {"supine", "tilt45"}) {
    auto fields = stand.fields(pose);
    const Eigen::Vector3d down = fields.gravity;
    nuisances.apply(stand.stage(pose), fields);
    const auto& own = nuisances.numbers_of(pose);
    const double angle = std::acos(down.normalized().dot(fields.gravity.normalized()));
    // Small turns about two axes; gravity lies along y, so that neither is about itself.
    EXPECT_NEAR(angle, std::hypot(own.at("gravity_roll_rad"), own.at("gravity_pitch_rad")), 0.02 * angle + 1e-6);
    EXPECT_NEAR(fields.gravity.norm(), down.norm(), 1e-9 * down.norm());
    moved.push_back(fields.muscle_offset);
  }
  // The muscle is the same in both; breath, a hill of its own height in each, is what differs.
  const double breath = nuisances.numbers_of("supine").at("breath_mm") - nuisances.numbers_of("tilt45").at("breath_mm");
  const Eigen::VectorXd difference = moved[0] - moved[1];
  EXPECT_NEAR(difference.cwiseAbs().maxCoeff(), std::abs(breath), 0.1 * std::abs(breath));
}

TEST(Nuisances, LookLikeCausesOnlyWhereTheyAreThreeTimesAsWide) {
  int wide = 0, far = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const Nuisances nuisances(seed, Nuisances::Kind::realistic, {}, poses);
    const auto like = nuisances.look_like();
    EXPECT_EQ(std::count(like.begin(), like.end(), "strain_stiffening"), 1);
    EXPECT_TRUE(nuisances.width() > 1 || like.size() == 1);
    wide += nuisances.width() > 1;
    far += like.size() > 1;
    EXPECT_TRUE(Nuisances(seed, Nuisances::Kind::prior, {}, poses).look_like().empty());
  }
  EXPECT_GT(far, wide / 2);
}

TEST(CausePrior, DrawsAsManyAsItSays) {
  constexpr int draws = 4000;
  std::array<int, 4> count{};
  std::map<std::string, int> of;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) {
    const auto causes = draw_causes_from_prior(seed);
    ++count.at(causes.size());
    std::set<std::string> names;
    for (const Cause& cause : causes) {
      EXPECT_TRUE(names.insert(cause.name).second);
      ++of[cause.name];
    }
  }
  for (std::size_t k = 0; k < count.size(); ++k)
    EXPECT_NEAR(count[k], draws * prior_of_sets[k], 4 * std::sqrt(draws * prior_of_sets[k] * (1 - prior_of_sets[k])));
  // Evenly shared: 0.3 + 2 × 0.15 + 3 × 0.05 causes a case.
  const double each = 0.75 * draws / static_cast<double>(catalogue_causes().size());
  for (const std::string& name : catalogue_causes()) EXPECT_NEAR(of[name], each, 4.5 * std::sqrt(each)) << name;
}

TEST(CausePrior, SizesHaveTheirWidthsWithinTheCataloguesRanges) {
  constexpr int draws = 2000;
  std::map<std::string, double> squares;
  double below = 0;
  for (const std::string& name : catalogue_causes())
    for (std::uint64_t seed = 1; seed <= draws; ++seed) {
      const Cause cause = draw_cause_from_prior(name, seed);
      for (const auto& row : simulation::find_effect(name)->parameters()) {
        const double value = cause.values.at(row.name);
        ASSERT_TRUE(value >= row.lower && value <= row.upper) << name << "." << row.name << " = " << value;
        squares[name + "." + row.name] += value * value / draws;
      }
      if (name == "ligament") below += cause.values.at("stiffness_kpa_per_mm") < 0.4;
    }
  const auto sd = [&](const char* what) { return std::sqrt(squares.at(what)); };
  constexpr double degree = std::numbers::pi / 180;
  EXPECT_NEAR(sd("gravity_tilt.roll_rad"), 10 * degree, 0.7 * degree);
  EXPECT_NEAR(sd("stiffness_gradient.head"), 0.5, 0.035);
  // The range cuts these a little.
  EXPECT_NEAR(sd("misregistration.shift_y_mm"), 9.7, 0.7);
  EXPECT_NEAR(sd("misregistration.turn_z_rad"), 7.9 * degree, 0.6 * degree);
  EXPECT_NEAR(sd("segmentation_offset.offset_mm"), 1.32, 0.1);
  EXPECT_NEAR(below / draws, 0.5, 0.06);  // the median
}

TEST(CauseSize, SetsTheStrengthAndNothingElse) {
  const Cause drawn = draw_cause("ligament", 5), weak = draw_cause("ligament", 5, 0),
              strong = draw_cause("ligament", 5, 1);
  EXPECT_DOUBLE_EQ(weak.values.at("stiffness_kpa_per_mm"), 0.2);
  EXPECT_DOUBLE_EQ(strong.values.at("stiffness_kpa_per_mm"), 1.2);
  for (const Cause& sized : {weak, strong}) {
    EXPECT_EQ(sized.values.at("offset_mm"), drawn.values.at("offset_mm"));
    EXPECT_EQ(sized.place, drawn.place);
  }
  const Cause tilt = draw_cause("gravity_tilt", 5), half = draw_cause("gravity_tilt", 5, 0.5);
  const Eigen::Vector2d a(tilt.values.at("roll_rad"), tilt.values.at("pitch_rad")),
      b(half.values.at("roll_rad"), half.values.at("pitch_rad"));
  EXPECT_NEAR(b.norm(), 0.165, 1e-12);
  EXPECT_NEAR(a.normalized().dot(b.normalized()), 1, 1e-12);
  EXPECT_NEAR(std::abs(draw_cause("chest_wall_motion", 5, 1).values.at("amplitude_mm")), 8, 1e-12);
  EXPECT_THROW(draw_cause("misregistration", 5, 0.5), InputError);
}

TEST(Discrepancy, SizeIsHalfCauchy) {
  constexpr int draws = 3000;
  int below_quarter = 0, below_median = 0, above = 0;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) {
    const double size = half_cauchy(seed, 0.3, 1e9);
    below_quarter += size < 0.3 * std::tan(std::numbers::pi / 8);
    below_median += size < 0.3;
    above += half_cauchy(seed, 0.3, 10) > 10;
  }
  EXPECT_NEAR(below_quarter, draws / 4, 4 * std::sqrt(draws * 3 / 16));
  EXPECT_NEAR(below_median, draws / 2, 4 * std::sqrt(draws / 4));
  EXPECT_EQ(above, 0);
}

TEST(Discrepancy, MovesTheSkinByItsSizeOverDraws) {
  const Stand stand;
  std::vector<TruthPose> solved = truth_poses(true);
  Truth truth(stand.body_mesh, stand.body, {}, nullptr);
  truth.solve(solved);
  constexpr int draws = 30;
  double square = 0, alike = 0;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) {
    const Discrepancy discrepancy(truth, stand.body_mesh, solved, seed);
    EXPECT_LE(discrepancy.size_mm(), 10);
    for (const char* pose : {"supine", "tilt45"})
      square += std::pow(discrepancy.rms_mm(pose) / discrepancy.size_mm(), 2) / (2 * draws);
    const Points &a = discrepancy.displacement("supine"), &b = discrepancy.displacement("tilt45");
    alike += a.cwiseProduct(b).sum() / (a.norm() * b.norm()) / draws;
  }
  // Half of the forces is common to the poses.
  EXPECT_NEAR(square, 1, 0.3);
  EXPECT_NEAR(alike, 0.5, 0.25);
}

TEST(Placement, OneAfterTheOtherIsBoth) {
  Scan twice;
  twice.surface.points = Points::Random(7, 3) * 50;
  twice.landmarks.points = Points::Random(3, 3) * 50;
  Scan once = twice;
  const Placement first{{1, -2, 3}, {0.1, 0.2, -0.3}}, second{{-4, 5, 0.5}, {-0.3, 0.1, 0.2}};
  move_scan(first, twice);
  move_scan(second, twice);
  move_scan(after(first, second), once);
  EXPECT_LT((once.surface.points - twice.surface.points).norm(), 1e-10);
  EXPECT_LT((once.landmarks.points - twice.landmarks.points).norm(), 1e-10);
}

TEST(Realistic, ScanLiesWhereThePlaceSaysAndLandmarksStateTheirError) {
  PhantomOptions options = coarse(11);
  options.realistic = true;
  options.effects = {"misregistration", "creep", "adhesion"};
  const Phantom phantom = make_phantom(options);
  const BodyMesh body_mesh = mesh_body(phantom.body, options.seed, options.rings, options.order);
  ScanOptions scanner{options.noise_mm, 0.2, {phantom.nuisances->scan_error("supine")}};
  const Scan straight = scan_pose(body_mesh, phantom.body, "supine", phantom.poses[1].x, options.seed, scanner);
  const Points& moved = phantom.contents.poses[0].scan.surface.points;
  ASSERT_EQ(moved.rows(), straight.surface.points.rows());
  const Eigen::RowVector3d shift = moved.colwise().mean() - straight.surface.points.colwise().mean();
  EXPECT_LT((shift.transpose() - phantom.places.at("supine").shift_mm).norm(), 1e-9);
  // Nuisance and cause together.
  EXPECT_NEAR(shift.x(),
              phantom.nuisances->numbers_of("supine").at("shift_x_mm") + phantom.causes[0].values.at("shift_x_mm"),
              1e-9);
  EXPECT_EQ(phantom.contents.poses[0].scan.landmarks.sigma_mm, Eigen::VectorXd::Constant(5, 1.5));
  EXPECT_EQ(phantom.contents.prone_landmarks.sigma_mm.size(), 0);
}

// The scan's points err together by 0.4 mm beside their own noise.
TEST(Realistic, ScanErrorIsPartlyShared) {
  double square = 0;
  int points = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const RandomField error = Nuisances(seed, Nuisances::Kind::realistic, {}, poses).scan_error("supine");
    for (const double x : {0, 60, 120}) {
      square += std::pow(error.at({x, 0, 0}), 2);
      EXPECT_NEAR(error.at({x, 0, 0}), error.at({x + 1, 0, 0}), 0.1);
      ++points;
    }
  }
  EXPECT_NEAR(std::sqrt(square / points), 0.4, 0.1);
}

TEST(Prior, CausesActAsInTheCatalogue) {
  const Stand stand;
  for (const std::string& name : catalogue_causes()) {
    const std::vector<Cause> causes = {draw_cause_from_prior(name, 3)};
    const Truth truth(stand.body_mesh, stand.body, causes, nullptr);
    simulation::Model model = truth_model(stand.body);
    model.effects.push_back(simulation::null_setting(*simulation::find_effect(name)));
    for (const auto& [key, value] : causes[0].values) model.effects[0].parameters.at(key).value = value;
    const simulation::Scene scene{stand.body_mesh.mesh, stand.body_mesh.anatomy, stand.mechanics.layout(), "supine"};
    const auto expected = simulation::values_of(simulation::make_fields(model, scene, Eigen::Vector3d::UnitY()));
    const auto found = truth.fields({"supine", Eigen::Vector3d::UnitY(), {}});
    for (const auto& row : simulation::field_columns<double>)
      EXPECT_EQ(found.*row.column, expected.*row.column) << name << " " << row.name;
  }
}

}  // namespace
}  // namespace supine::phantom
