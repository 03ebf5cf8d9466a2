// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/whitening.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "tests/diagnosis/sheet.h"

namespace supine::diagnosis {
namespace {

using supine::testing::sheet;

ErrorSources sources_of(const calibration::Residuals& r) {
  ErrorSources sources;
  sources.noise_mm = Eigen::VectorXd::Constant(r.size(), 0.5);
  sources.mean_mm = Eigen::VectorXd::Zero(r.size());
  sources.spread_mm = 0.3;
  sources.length_mm = 15;
  sources.modes.push_back({"registration", r.place.col(0) / 60});
  return sources;
}

TEST(Whitening, ErrorsOfAllSourcesBecomeIndependent) {
  const calibration::Residuals r = sheet(6, 300);
  ErrorSources sources = sources_of(r);
  sources.share = (1 + 0.5 * (r.place.col(1).array() / 20).sin()).matrix();
  const Whitening whitening = Whitening::of(r, sources);
  const calibration::Clusters& clusters = whitening.clusters();
  const Eigen::Index n = clusters.members.size();
  const Eigen::VectorXd share = clusters.means(sources.share);
  const Eigen::VectorXd mode = clusters.means(r.place.col(0) / 60);
  Eigen::MatrixXd sigma = mode * mode.transpose();
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      sigma(i, j) +=
          0.09 * share[i] * share[j] * std::exp(-(clusters.place.row(i) - clusters.place.row(j)).norm() / 15) +
          (i == j ? 0.25 / clusters.members[i] : 0);
  Eigen::MatrixXd by_point(300, n);
  for (int i = 0; i < 300; ++i) by_point.row(i) = sigma.row(clusters.of_point[i]);
  const Eigen::MatrixXd half = whitening.apply(by_point);  // L⁻¹ Σ = Lᵀ
  EXPECT_LT((half.transpose() * half - sigma).norm(), 1e-9 * sigma.norm());
}

TEST(Whitening, RefusesErrorsWithoutNoise) {
  const calibration::Residuals r = sheet(5, 200);
  ErrorSources sources = sources_of(r);
  sources.noise_mm.setZero();
  sources.spread_mm = 0;
  try {
    Whitening::of(r, sources);
    FAIL() << "points without any error of their own";
  } catch (const NumericalFailure& failure) {
    EXPECT_NE(std::string(failure.what()).find("not positive"), std::string::npos) << failure.what();
  }
}

TEST(Whitening, AnErrorModeCountsForLittleAndItsOppositeForAsMuchAsBefore) {
  const calibration::Residuals r = sheet(7, 400);
  ErrorSources sources = sources_of(r);
  sources.modes[0].shape_mm *= 100;
  const Whitening with = Whitening::of(r, sources);
  sources.modes.clear();
  const Whitening without = Whitening::of(r, sources);
  const Eigen::VectorXd along = r.place.col(0) / 60, across = r.place.col(1) / 60;
  EXPECT_LT(with.apply(along).norm(), 0.02);
  EXPECT_GT(without.apply(along).norm(), 1);
  EXPECT_GT(with.apply(across).norm(), 0.8 * without.apply(across).norm());
}

}  // namespace
}  // namespace supine::diagnosis
