// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/left_out.h"

#include "calibration/held_out.h"

namespace supine::diagnosis {
namespace {

double ln_evidence_of(const ErrorCovariance& errors, const Hypothesis& h, const Eigen::VectorXd& y,
                      const std::vector<int>& clusters) {
  Directions all = h.evidence->directions();
  all.columns = Eigen::MatrixXd(all.columns(clusters, Eigen::all));
  return LinearEvidence(errors, y(clusters), std::move(all)).weigh(h.rows).ln_evidence;
}

}  // namespace

std::vector<LeftOut> left_out_parts(const calibration::MeasuredScene& scene, const BaseFit& base) {
  std::vector<LeftOut> parts;
  const auto& of_point = base.clusters.of_point;
  Eigen::VectorXi part_of = base.clusters.pose;
  if (scene.measurements.size() > 1) {
    for (const auto* measurement : scene.measurements) parts.push_back({measurement->pose.name, {}});
  } else {
    const Eigen::VectorXi blocks = calibration::spatial_blocks(base.fit.residuals);
    for (Eigen::Index r = of_point.size(); r-- > 0;) part_of[of_point[r]] = blocks[r];
    parts.assign(static_cast<std::size_t>(blocks.maxCoeff() + 1), {"a block of skin", {}});
  }
  for (Eigen::Index c = 0; c < part_of.size(); ++c)
    parts[static_cast<std::size_t>(part_of[c])].clusters.push_back(static_cast<int>(c));
  return parts;
}

double left_out_gain(const BaseFit& base, const Hypothesis& first, const Hypothesis& second, const LeftOut& part) {
  std::vector<bool> out(static_cast<std::size_t>(base.errors.rows()), false);
  for (const int c : part.clusters) out[static_cast<std::size_t>(c)] = true;
  std::vector<int> rest;
  for (int c = 0; c < static_cast<int>(out.size()); ++c)
    if (!out[static_cast<std::size_t>(c)]) rest.push_back(c);
  if (rest.empty()) return 0;
  const ErrorCovariance errors(base.errors(rest, rest), base.kernel(rest, rest), base.scale_mm, base.most_mm);
  const auto given_rest = [&](const Hypothesis& h) {
    return h.ln_evidence - ln_evidence_of(errors, h, h.evidence->distances(), rest);
  };
  return given_rest(first) - given_rest(second);
}

}  // namespace supine::diagnosis
