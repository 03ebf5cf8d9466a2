// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/unlisted.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/field_modes.h"
#include "diagnosis/evidence/hypotheses.h"
#include "simulation/mechanics.h"
#include "tests/simulation/scene.h"

namespace supine::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int count = 60, causes = 12, there = 7;

Points places() {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(-60, 60);
  Points points(count, 3);
  for (int i = 0; i < count; ++i) points.row(i) << uniform(generator), uniform(generator), 0;
  return points;
}

/// A sheet whose skin a stiff spot lifts by up to a tenth of a millimetre for each standard deviation.
struct Sheet {
  Points place = places();
  MatrixXd errors = 0.02 * MatrixXd::Identity(count, count);
  MatrixXd kernel = gaussian_kernel(place, place, 40);
  ErrorCovariance covariance{errors, kernel, 0.3, 10};
  BaseFit base;
  VectorXd noise;

  Sheet() {
    const Points centres = place.topRows(causes);
    base.local.columns = 0.1 * gaussian_kernel(place, centres, 12);
    base.local.kind.assign(causes, LocalKind::tissue);
    for (int c = 0; c < causes; c += 3) base.local.kind[static_cast<std::size_t>(c)] = LocalKind::muscle;
    base.local.place = centres;
    base.local.unit = VectorXd::Constant(causes, 0.25);
    std::mt19937_64 generator(2);
    std::normal_distribution<double> normal(0, std::sqrt(0.02));
    noise = VectorXd::NullaryExpr(count, [&] { return normal(generator); });
  }

  Directions directions() const {
    Directions all;
    all.add("modulus", VectorXd::Ones(count), 0.1, 0.5);
    all.add("effect.size", (place.col(0) / 30).array().sin().matrix(), 0.5, 1.0);
    return all;
  }

  /// Nothing, and one effect that all but does what is there.
  std::vector<Hypothesis> hypotheses(const VectorXd& y) const {
    const auto evidence = std::make_shared<const LinearEvidence>(covariance, y, directions());
    std::vector<Hypothesis> list(2);
    list[1].effects = {0};
    list[0].ln_prior = std::log(0.6), list[1].ln_prior = std::log(0.4);
    for (std::size_t i = 0; i < 2; ++i) {
      list[i].rows = i == 0 ? std::vector{0} : std::vector{0, 1};
      list[i].evidence = evidence;
      list[i].weighed = evidence->weigh(list[i].rows);
      list[i].ln_evidence = list[i].weighed.ln_evidence;
    }
    normalise(list);
    return list;
  }
};

TEST(Unlisted, ItsGainIsThatOfTheEvidenceWithOneDirectionMore) {
  const Sheet sheet;
  const VectorXd y = sheet.noise - 5 * sheet.base.local.columns.col(there);
  const LinearEvidence evidence(sheet.covariance, y, sheet.directions());
  constexpr double sd = 3;
  for (const std::vector<int>& which : {std::vector{0}, std::vector{0, 1}}) {
    const Weighed weighed = evidence.weigh(which);
    const VectorXd gain = ln_gain_of_one_more(evidence, which, weighed, sheet.base.local.columns, sd);
    for (const int c : {0, there}) {
      Directions more = sheet.directions();
      more.add("cause", sheet.base.local.columns.col(c), 0, sd);
      std::vector<int> with = which;
      with.push_back(2);
      const double direct = LinearEvidence(sheet.covariance, y, more).weigh(with).ln_evidence - weighed.ln_evidence;
      EXPECT_NEAR(gain[c], direct, 1e-8) << c;
    }
  }
}

TEST(Unlisted, AStiffSpotThatNoEffectListsIsFoundInItsPlaceAndSize) {
  const Sheet sheet;
  constexpr double size = 8;  // standard deviations of the field
  std::vector<Hypothesis> list = sheet.hypotheses(sheet.noise - size * sheet.base.local.columns.col(there));
  const Unlisted found = weigh_unlisted(sheet.base, {}, list);
  EXPECT_GT(found.probability, 0.95);
  EXPECT_EQ(found.kind, LocalKind::tissue);
  EXPECT_EQ(found.place_mm, sheet.base.local.place.row(there).transpose());
  EXPECT_LT(found.low, 0.25 * size);
  EXPECT_GT(found.high, 0.25 * size);
  EXPECT_NEAR(found.size, 0.25 * size, 0.5);
  double sum = 0;
  for (const Hypothesis& h : list) sum += h.probability;
  EXPECT_NEAR(sum, 1, 1e-12);
}

TEST(Unlisted, WhereNothingIsThereItIsLessLikelyThanBefore) {
  const Sheet sheet;
  std::vector<Hypothesis> list = sheet.hypotheses(sheet.noise);
  const Priors priors;
  EXPECT_LT(weigh_unlisted(sheet.base, priors, list).probability, priors.unlisted);
  EXPECT_TRUE(list.front().effects.empty());
}

TEST(Unlisted, AnEffectThatIsThereStaysTheLikeliest) {
  const Sheet sheet;
  std::vector<Hypothesis> list = sheet.hypotheses(sheet.noise - 2 * sheet.directions().columns.col(1));
  const Unlisted found = weigh_unlisted(sheet.base, {}, list);
  EXPECT_EQ(list.front().effects, std::vector{0});
  EXPECT_GT(list.front().probability, 0.95);
  EXPECT_LT(found.probability, 0.5);
}

TEST(Unlisted, NoneIsWeighedWhereThePriorHasNone) {
  const Sheet sheet;
  std::vector<Hypothesis> list = sheet.hypotheses(sheet.noise - 8 * sheet.base.local.columns.col(there));
  const double before = list.front().probability;
  Priors priors;
  priors.unlisted = 0;
  EXPECT_EQ(weigh_unlisted(sheet.base, priors, list).probability, 0);
  EXPECT_EQ(list.front().probability, before);
}

TEST(LocalCauses, AreBumpsOfTissueSkinAndMuscleInTheirPlaces) {
  const supine::testing::TestScene& scene = supine::testing::dome_scene(1);
  const simulation::Mechanics mechanics(scene.mesh, scene.anatomy, supine::testing::soft_model());
  const Patchiness patchiness;
  const PatchyFields fields = patchy_fields(mechanics, patchiness);
  const Eigen::Index modes = fields.tissue.cols() + fields.skin.cols() + fields.muscle.cols();
  const LocalCauses all = local_causes(mechanics, patchiness, MatrixXd::Identity(modes, modes));
  ASSERT_GT(all.columns.cols(), 30);
  std::array<int, local_kinds> of_kind{};
  for (Eigen::Index c = 0; c < all.columns.cols(); ++c) {
    const LocalKind kind = all.kind[static_cast<std::size_t>(c)];
    ++of_kind[static_cast<std::size_t>(kind)];
    EXPECT_NEAR(all.columns.col(c).norm(), 1, 1e-12);
    // The field that it is: largest where it stands.
    if (kind != LocalKind::tissue) continue;
    const VectorXd field = fields.tissue * all.columns.col(c).head(fields.tissue.cols());
    Eigen::Index largest;
    field.maxCoeff(&largest);
    Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
    for (int a = 0; a < 4; ++a) at += 0.25 * scene.mesh.points.row(scene.mesh.cells(largest, a));
    EXPECT_LT((at - all.place.row(c)).norm(), patchiness.tissue_length_mm) << c;
  }
  for (const int n : of_kind) EXPECT_GT(n, 5);
  EXPECT_EQ(all.unit[0], patchiness.tissue);
}

}  // namespace
}  // namespace supine::diagnosis
