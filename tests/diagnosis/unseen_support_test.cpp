// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "diagnosis/examine.h"
#include "diagnosis/next_measurement.h"
#include "tests/simulation/scene.h"

// A bar held by one end: whether its clamp gives way, a modulus tells as well, where skin near the clamp is missing.
namespace supine::diagnosis {
namespace {

constexpr double noise_mm = 0.5;
constexpr const char* clamp = "support_compliance";

simulation::Model rubber() {
  simulation::Model model;
  model.breast.young_modulus_kpa = {120, true, 120, 10, 2000};
  model.breast.poisson_ratio.value = 0.49;
  model.breast.density_kg_m3.value = 1080;
  model.skin.young_modulus_kpa.value = 0;
  model.interface.kind = simulation::InterfaceKind::fixed;
  return model;
}

/// The bar in a rigid clamp, and a scan of its skin beyond some distance from the clamp.
struct Bar {
  explicit Bar(double from_mm)
      : scene(testing::bar_scene(170, 30, 8, 2)),
        imaged{simulation::free_of_load, Eigen::Vector3d::Zero()},
        hanging{"hanging", {0, -1, 0}} {
    const auto solution = simulation::solve_chain(scene.mesh, scene.anatomy, rubber(), {imaged, hanging});
    const calibration::ModelSkin skin(scene.mesh, solution.poses[0].x);
    std::mt19937 generator(1);
    std::normal_distribution<double> normal(0, noise_mm);
    std::vector<Eigen::RowVector3d> points;
    const auto& triangles = skin.triangles();
    for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
      const Points corner = solution.poses[0].x(triangles.row(t).transpose().eval(), Eigen::all);
      const double from_clamp = -scene.mesh.points(triangles.row(t).transpose().eval(), 0).mean();
      const Eigen::RowVector3d outward =
          Eigen::RowVector3d(corner.row(1) - corner.row(0)).cross(corner.row(2) - corner.row(0)).normalized();
      const double off = normal(generator);
      if (from_clamp > from_mm) points.emplace_back(corner.colwise().mean() + off * outward);
    }
    reconstruction::Surface surface;
    surface.points.resize(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i) surface.points.row(static_cast<Eigen::Index>(i)) = points[i];
    measurement.reset(new calibration::Measurement{hanging, calibration::Scan(surface, skin), noise_mm});
    ExamineOptions options;
    options.other_meshes = false;
    options.refits = 1;
    options.priors.expected = {clamp};
    options.priors.known.registration_mm = 2.5, options.priors.known.registration_rad = 0.035;
    options.priors.known.gravity_rad = 0.0175, options.priors.known.segmentation_mm = 0.1;
    options.priors.patchiness.tissue = 0.05;
    options.priors.of_pose["hanging"] = {options.priors.known, noise_mm, 60};
    subject = {{&scene.mesh, &scene.anatomy, imaged, {measurement.get()}}, rubber(), rubber(), {noise_mm}, nullptr};
    found = examine(subject, options);
  }

  bool is_seen() const {
    const auto unseen = not_seen(*found);
    return std::find(unseen.begin(), unseen.end(), clamp) == unseen.end();
  }

  const Candidate& candidate() const {
    return *std::find_if(found->candidates.begin(), found->candidates.end(),
                         [](const Candidate& c) { return c.effect == clamp; });
  }

  testing::TestScene scene;
  simulation::PoseLoad imaged, hanging;
  std::unique_ptr<calibration::Measurement> measurement;
  Subject subject;
  std::unique_ptr<Findings> found;
};

TEST(UnseenSupport, WithAllOfTheSkinAClampThatGivesWayWouldShow) { EXPECT_TRUE(Bar(0).is_seen()); }

TEST(UnseenSupport, WithoutTheSkinNearItTheDiagnosisSaysSoAndAsksForThatSkin) {
  const Bar bar(90);
  EXPECT_FALSE(bar.is_seen());
  EXPECT_NE(bar.found->diagnosis.verdict, Verdict::nothing_missing) << "the case expects it, and nobody has seen it";
  ASSERT_TRUE(bar.candidate().stand_in);
  ASSERT_EQ(bar.candidate().stand_in->made_up.size(), 1u);
  const MadeUp& modulus = bar.candidate().stand_in->made_up[0];
  EXPECT_EQ(modulus.name, "breast.young_modulus_kpa");
  EXPECT_GT(modulus.to, 1.05 * modulus.from) << "the clamp lets the bar down, a stiffer bar holds it up";
  const auto next = next_measurements(bar.subject, *bar.found, bar.found->diagnosis.missing);
  ASSERT_FALSE(next.empty());
  EXPECT_EQ(next.front().measurement, "hanging, with the skin near the support");
  EXPECT_EQ(next.front().shows, clamp);
}

TEST(UnseenSupport, StraightLinesPromiseThatItShows) {
  const Bar bar(90);
  const Whitening& white = bar.found->errors->whitening();
  const Eigen::VectorXd slope = white.apply(bar.found->base.fit.linearisation.slope);
  const Eigen::VectorXd secant = white.apply(bar.candidate().secant);
  const double along_lines = (secant - slope * (slope.dot(secant) / slope.squaredNorm())).squaredNorm();
  EXPECT_TRUE(settles(along_lines, 1)) << along_lines;
}

}  // namespace
}  // namespace supine::diagnosis
